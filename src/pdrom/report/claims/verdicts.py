"""Verdicts: the tests of a claim, evaluated."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pdrom.report.claims.metrics import METRICS, Tables, filtered
from pdrom.report.claims.rules import ClaimRule, TestRule
from pdrom.tables import declared

VERDICTS = HOLDS, FAILS, UNDECIDED = "holds", "does not hold", "cannot be decided"


@dataclass(frozen=True)
class Outcome:
    """Result of one test: None where there was nothing to compare."""

    passed: bool | None
    measured: str
    sentence: str


def timed_columns(rule: ClaimRule) -> set[str]:
    """Columns of a claim's row in which a clock has a say: two runs may differ there."""
    timed = [test for test in rule.tests if _is_timed(test)]
    if not timed:
        return set()
    return {"why", "measured", "verdict"} if any(t.decides for t in timed) else {"why"}


def _is_timed(test: TestRule) -> bool:
    metric = METRICS[test.metric]
    timing = declared()[metric.table].timing_columns
    return not set(timing).isdisjoint({*metric.columns, *test.where})


def evaluate(test: TestRule, tables: Tables) -> Outcome:
    """Compare the rows of a test with its threshold."""
    values = METRICS[test.metric].values(tables, dict(test.where)).to_numpy(float)
    if len(values) == 0:
        return Outcome(None, "no data", f"{test.what}: {_why_empty(test, tables)}")
    passed = values >= test.threshold if test.compare == ">=" else values <= test.threshold
    good, total = int(passed.sum()), len(values)
    spread = _range(values)
    sign = "at least" if test.compare == ">=" else "at most"
    sentence = f"{test.what}: {good} of {total} {sign} {test.threshold:g} (measured {spread})"
    return Outcome(good >= test.share * total, spread, sentence)


def _why_empty(test: TestRule, tables: Tables) -> str:
    """Why a test has no values: reruns that could not start, or none in this configuration."""
    if test.metric == "rerun_error":
        where = {k: v for k, v in test.where.items() if k != "r"}
        if len(filtered(tables["reduced_reruns"], where)):
            return "no size can run, the numerical rank allows none"
    return "nothing to compare in this configuration"


def _range(values: np.ndarray) -> str:
    low, high = _text(values.min()), _text(values.max())
    return low if low == high else f"{low} to {high}"


def _text(value: float) -> str:
    if np.isinf(value):
        return "blow-up"
    if 100.0 <= abs(value) < 1e5:
        return f"{float(f'{value:.2g}'):.0f}"
    return f"{value:.2g}"


def claims_rows(rules: Mapping[str, ClaimRule], tables: Tables) -> pd.DataFrame:
    """Rows of the table claims, in the order of the file."""
    return pd.DataFrame([_row(name, rule, tables) for name, rule in rules.items()])


def _row(name: str, rule: ClaimRule, tables: Tables) -> dict[str, Any]:
    outcomes = [(test, evaluate(test, tables)) for test in rule.tests]
    deciding = [o for test, o in outcomes if test.decides]
    if any(o.passed is None for o in deciding):
        verdict = UNDECIDED
    else:
        verdict = HOLDS if all(o.passed for o in deciding) else FAILS
    return {
        "claim": name,
        "source": rule.source,
        "paper": rule.paper,
        "measured": "; ".join(o.measured for o in deciding),
        "verdict": verdict,
        "why": "; ".join(o.sentence for _, o in outcomes) + ".",
        "figure_or_table": rule.figure_or_table,
    }
