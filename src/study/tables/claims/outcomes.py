"""Every test of every claim with what it found, one row each."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from study.tables.claims.rows import VALUE, Tables
from study.tables.claims.rules import ClaimRule, TestRule
from study.tables.claims.sensitivity import PARTS
from study.tables.claims.verdicts import answer_of, close, satisfied, values_of

SAID = {"what", "metric", "decides", "compare", "threshold", "share"}
FOUND = ("satisfied", "of", "close", "least", "median", "most", "verdict")


def outcome_rows(rules: Mapping[str, ClaimRule], tables: Tables) -> pd.DataFrame:
    """Rows of the table claims_tests from ``rules`` and ``tables``, in the order of the file."""
    rows = [
        {"claim": name, "part": part, **_said(test), **_found(test, tables)}
        for name, rule in rules.items()
        for part in PARTS
        for test in getattr(rule, part)
    ]
    return pd.DataFrame(rows)


def _said(test: TestRule) -> dict[str, Any]:
    return test.model_dump(include=SAID) | {"margin": test.factor if test.timed else None}


def _found(test: TestRule, tables: Tables) -> dict[str, Any]:
    """Counts and the range of the values, which is empty where there are none."""
    values = values_of(test, tables)[VALUE].to_numpy(float)
    good, total = int(satisfied(test, values).sum()), len(values)
    spread = (values.min(), np.median(values), values.max()) if total else (None, None, None)
    found = (good, total, int(close(test, values).sum()), *spread, answer_of(test, values))
    return dict(zip(FOUND, found, strict=True))
