"""Table claims_tests: every test of config/claims.yaml and what it found."""

from pathlib import Path

import pandas as pd

from study.artifact.reads import ProjectFile, Setting, TableOf
from study.tables.claims import FOUND, VERDICTS, is_timed, load_claims, outcome_rows
from study.tables.claims.metrics import READ
from study.tables.claims.rules import NONE_ADDED, Added
from study.tables.claims.sensitivity import PARTS
from study.tables.kit.declaration import compared, flag, integer, number, table, text, timed


def _timed_cells(table: pd.DataFrame, **files: Path) -> list[set[str]]:
    rules = load_claims(files["rules"])
    tests = {
        (claim, part, test.what): test
        for claim, rule in rules.items()
        for part in PARTS
        for test in getattr(rule, part)
    }
    keys = zip(table.claim, table.part, table.what, strict=True)
    return [set(FOUND) if is_timed(tests[key]) else set() for key in keys]


@table(
    title="Tests of the claims",
    columns=(
        text("claim", "its identifier in config/claims.yaml"),
        text("part", f"which verdict: {', '.join(PARTS)}"),
        text("what", "words for the rows that are compared"),
        text("metric", "what is compared"),
        flag("decides", "the verdict rests on it; the others are for information"),
        text("compare", "comparison with the threshold"),
        number("threshold", "what a value is compared with"),
        number("share", "of the rows that must agree for a clear answer"),
        number("margin", "factor of the threshold within which a ratio of times decides nothing"),
        compared("skipped", timed(integer("satisfied", "rows that satisfy the comparison"))),
        compared("skipped", timed(integer("of", "rows that are compared"))),
        compared("skipped", timed(integer("close", "of them, ratios of times within the margin"))),
        compared(
            "skipped", timed(number("least", "smallest value; infinite for a run that failed"))
        ),
        compared("skipped", timed(number("median", "their median"))),
        compared("skipped", timed(number("most", "largest value"))),
        compared("exact", timed(text("verdict", f"of this test, one of: {', '.join(VERDICTS)}"))),
    ),
    reads={
        "rules": ProjectFile("config/claims.yaml"),
        "added": Setting("claim_sets"),
        **{name: TableOf(name) for name in READ},
    },
    timed_cells=_timed_cells,
)
def claims_tests(rules: Path, added: Added = NONE_ADDED, **tables: pd.DataFrame) -> pd.DataFrame:
    """One row per claim, part and test, in the order of the file ``rules``; see `claims`."""
    return outcome_rows(load_claims(rules, added), tables)
