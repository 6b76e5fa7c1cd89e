"""Table claims_sensitivity: which verdicts stand when a rule of config/claims.yaml changes."""

from pathlib import Path

import pandas as pd

from study.artifact.reads import ProjectFile, Setting, TableOf
from study.tables.claims import VERDICTS, load_claims, timed_columns
from study.tables.claims.metrics import READ
from study.tables.claims.rules import NONE_ADDED, Added
from study.tables.claims.sensitivity import PARTS, VARIED, sensitivity_rows
from study.tables.kit.declaration import compared, flag, table, text, timed

# Share of the variations whose verdict a few runs decide.
FRAGILE = 0.01


def _timed_cells(table: pd.DataFrame, **files: Path) -> list[set[str]]:
    loaded = load_claims(files["rules"])
    suffix = {"published": "", "beyond": "_beyond"}
    cells = {"verdict", "verdict_of_rules", "same"}
    return [
        cells if f"verdict{suffix[part]}" in timed_columns(loaded[claim]) else set()
        for claim, part in zip(table.claim, table.part, strict=True)
    ]


@table(
    title="Verdicts under other rules",
    columns=(
        text("claim", "its identifier in config/claims.yaml"),
        text("part", f"tests that decide: {', '.join(PARTS)}"),
        text("varied", f"what is changed in all of them: {', '.join(VARIED)}"),
        text("variation", "how: factor, share, sizes, split, scene left out"),
        compared("exact", timed(text("verdict", f"one of: {', '.join(VERDICTS)}")), FRAGILE),
        compared(
            "exact",
            timed(text("verdict_of_rules", "the verdict of the rules as they are")),
        ),
        compared("exact", timed(flag("same", "the two agree")), FRAGILE),
    ),
    reads={
        "rules": ProjectFile("config/claims.yaml"),
        "added": Setting("claim_sets"),
        **{name: TableOf(name) for name in READ},
    },
    timed_cells=_timed_cells,
)
def claims_sensitivity(
    rules: Path, added: Added = NONE_ADDED, **tables: pd.DataFrame
) -> pd.DataFrame:
    """One row per claim of the file ``rules``, part and variation; see `claims`."""
    return sensitivity_rows(load_claims(rules, added), tables)
