"""Table claims_tests: every test of config/claims.yaml and what it found."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from study.tables.claims.metrics import VALUE, Tables
from study.tables.claims.rules import (
    NONE_ADDED,
    PARTS,
    READS,
    Added,
    ClaimRule,
    TestRule,
    load_claims,
)
from study.tables.claims.verdicts import VERDICTS, answer_of, close, satisfied, values_of
from study.tables.kit.declaration import compared, flag, integer, number, table, text, timed

SAID = {"what", "metric", "decides", "compare", "threshold", "share"}
FOUND = ("satisfied", "of", "close", "least", "median", "most", "verdict")


def _timed_cells(table: pd.DataFrame, **files: Path) -> list[set[str]]:
    rules = load_claims(files["rules"])
    tests = {
        (claim, part, test.what): test
        for claim, rule in rules.items()
        for part in PARTS
        for test in getattr(rule, part)
    }
    keys = zip(table.claim, table.part, table.what, strict=True)
    return [set(FOUND) if tests[key].timed else set() for key in keys]


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
    reads=READS,
    timed_cells=_timed_cells,
)
def claims_tests(rules: Path, added: Added = NONE_ADDED, **tables: pd.DataFrame) -> pd.DataFrame:
    """One row per claim, part and test, in the order of the file ``rules``; see `claims`."""
    return outcome_rows(load_claims(rules, added), tables)


def outcome_rows(rules: Mapping[str, ClaimRule], tables: Tables) -> pd.DataFrame:
    """Rows of the table claims_tests from ``rules`` and ``tables``, in the order of the file."""
    rows = [
        {"claim": name, "part": part, **test.model_dump(include=SAID), **_found(test, tables)}
        for name, rule in rules.items()
        for part in PARTS
        for test in getattr(rule, part)
    ]
    return pd.DataFrame(rows)


def _found(test: TestRule, tables: Tables) -> dict[str, Any]:
    """Margin, counts and the range of the values, which is empty where there are none."""
    values = values_of(test, tables)[VALUE].to_numpy(float)
    good, total = int(satisfied(test, values).sum()), len(values)
    spread = (values.min(), np.median(values), values.max()) if total else (None, None, None)
    found = (good, total, int(close(test, values).sum()), *spread, answer_of(test, values))
    margin = test.factor if test.timed else None
    return {"margin": margin, **dict(zip(FOUND, found, strict=True))}
