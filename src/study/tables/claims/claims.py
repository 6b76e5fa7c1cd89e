"""Table claims: the verdicts on the preprint's claims, with the rules of config/claims.yaml."""

from pathlib import Path

import pandas as pd

from study.artifact.reads import ProjectFile, Setting, TableOf
from study.tables.claims import VERDICTS, claims_rows, load_claims, timed_columns
from study.tables.claims.metrics import READ
from study.tables.claims.rules import NONE_ADDED, Added
from study.tables.kit.declaration import compared, text, timed
from study.tables.kit.declaration import table as declare


def _timed_cells(table: pd.DataFrame, **files: Path) -> list[set[str]]:
    loaded = load_claims(files["rules"])
    return [timed_columns(loaded[claim]) for claim in table.claim]


@declare(
    title="Verdicts on the claims of the preprint",
    columns=(
        text("claim", "its identifier in config/claims.yaml"),
        text("source", "who claims it"),
        text("paper", "what the preprint says"),
        compared(
            "skipped",
            timed(text("measured", "range of what was measured, of the tests that decide")),
        ),
        compared("exact", timed(text("verdict", f"as published, one of: {', '.join(VERDICTS)}"))),
        compared("skipped", timed(text("why", "all tests in words"))),
        text("figure_or_table", "where to see it"),
        text("section", "section of the preprint"),
        text("shown", "figures of the preprint"),
        text("text", "the claim in our words"),
        text("qualifiers", "what a fair test has to keep"),
        compared("skipped", timed(text("condition", "what the verdict depends on"))),
        compared(
            "skipped",
            timed(text("measured_beyond", "the same of sound variants on well-posed scenes")),
        ),
        compared("exact", timed(text("verdict_beyond", "the verdict there"))),
        compared("skipped", timed(text("condition_beyond", "what it depends on"))),
        compared("skipped", timed(text("why_beyond", "all tests there in words"))),
        compared("skipped", timed(text("answer", "both verdicts in words"))),
        text("history", "when and why the rules became what they are"),
    ),
    reads={
        "rules": ProjectFile("config/claims.yaml"),
        "added": Setting("claim_sets"),
        **{name: TableOf(name) for name in READ},
    },
    timed_cells=_timed_cells,
)
def claims(rules: Path, added: Added = NONE_ADDED, **tables: pd.DataFrame) -> pd.DataFrame:
    """One row per claim, in the order of the file ``rules``; see `claims_rows`."""
    return claims_rows(load_claims(rules, added), tables)
