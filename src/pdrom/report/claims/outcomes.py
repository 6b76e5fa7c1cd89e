"""Every test of every claim with what it found, one row each."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from pdrom.report.claims.rows import VALUE, Tables
from pdrom.report.claims.rules import ClaimRule, TestRule
from pdrom.report.claims.sensitivity import PARTS
from pdrom.report.claims.verdicts import answer, satisfied, values_of

SAID = {"what", "metric", "decides", "compare", "threshold", "share"}
FOUND = ("satisfied", "of", "least", "median", "most", "verdict")


def outcome_rows(rules: Mapping[str, ClaimRule], tables: Tables) -> pd.DataFrame:
    """Rows of the table claims_tests, in the order of the file."""
    rows = [
        {"claim": name, "part": part, **test.model_dump(include=SAID), **_found(test, tables)}
        for name, rule in rules.items()
        for part in PARTS
        for test in getattr(rule, part)
    ]
    return pd.DataFrame(rows)


def _found(test: TestRule, tables: Tables) -> dict[str, Any]:
    """Counts and the range of the values, which is empty where there are none."""
    values = values_of(test, tables)[VALUE].to_numpy(float)
    good, total = int(satisfied(test, values).sum()), len(values)
    spread = (values.min(), np.median(values), values.max()) if total else (None, None, None)
    found = (good, total, *spread, answer(test.share, good, total))
    return dict(zip(FOUND, found, strict=True))
