"""Verdicts that rest on times: whether another one says anything.

A test of a claim may compare times with a limit, such as speed-ups with one. Rows close to the
limit fall on either side of it from run to run, and the verdict with them. How close that is has
been measured (`timed_spreads`): a row may change sides if its value has moved by no more. What a
verdict owes to errors is compared exactly all the same.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np
import pandas as pd

from pdrom.report.claims import (
    METRICS,
    ClaimRule,
    Tables,
    TestRule,
    answer,
    combined,
    evaluate,
    is_timed,
    satisfied,
    values_of,
)
from pdrom.report.claims.rows import VALUE
from pdrom.tables import declared
from pdrom.verification.distance import distance
from pdrom.verification.rows import PARTS
from pdrom.verification.spread import Spread
from pdrom.verification.tolerances import Tolerances


def timed_spreads(
    rules: Mapping[str, ClaimRule], expected: Tables, found: Tables
) -> Iterator[Spread]:
    """How far apart the times are that verdicts rest on, test by test.

    Rows that count for something else than a time, such as a run that is not accurate, are left
    out.
    """
    for rule in rules.values():
        for test in (*rule.published, *rule.beyond):
            if not (test.decides and is_timed(test) and _there(test, expected, found)):
                continue
            both = _side_by_side(test, expected, found)
            if both is None:
                continue
            apart = distance("ratio", both.expected, both.found)
            cells = np.flatnonzero(_is_time(both.expected) & _is_time(both.found))
            if len(cells):
                column = _timed_column(test)
                table = METRICS[test.metric].table
                yield Spread(table, column, "ratio", rows_of(test), apart[cells], cells)


def rows_of(test: TestRule) -> str:
    """What the tolerance of a test is listed under, beside its quantity ``ratio``."""
    return f"claims by {test.metric}"


def changed_by_times(
    rules: Mapping[str, ClaimRule], expected: Tables, found: Tables, tolerances: Tolerances
) -> dict[tuple[str, str], str]:
    """Why changed verdicts say nothing, by claim and part; those that say something are left out.

    Parameters
    ----------
    expected, found : tables by name, those of the claims among them
    """
    sides = [tables["claims"].set_index("claim") for tables in (expected, found)]
    reasons = {}
    for claim, rule in rules.items():
        for column, part in PARTS.items():
            if not all(claim in frame.index for frame in sides):
                continue
            a, b = (str(frame.loc[claim, column]) for frame in sides)
            why = a != b and says_nothing(getattr(rule, part), (a, b), expected, found, tolerances)
            if why:
                reasons[claim, part] = why
    return reasons


def says_nothing(
    tests: Sequence[TestRule],
    verdicts: tuple[str, str],
    expected: Tables,
    found: Tables,
    tolerances: Tolerances,
) -> str | None:
    """Why the found one of two verdicts says nothing against the expected one, or None if it does.

    It says nothing if it is the verdict of the tables; if tests without times decide as expected;
    if in those with times the same rows hold times, and each row that has changed sides has moved
    within its tolerance; and if the expected verdict is one that such moves lead to.
    """
    deciding = [test for test in tests if test.decides]
    if not all(_there(test, expected, found) for test in deciding):
        return None
    options, words = [], []
    for test in deciding:
        if not is_timed(test):
            sides = [evaluate(test, tables).verdict for tables in (expected, found)]
            if sides[0] != sides[1]:
                return None
            options.append({sides[0]})
            continue
        both = _side_by_side(test, expected, found)
        limit = tolerances.get(("ratio", rows_of(test)))
        if both is None or limit is None or _moved_beyond(test, both, limit.every):
            return None
        options.append(_attainable(test, both.expected, limit.every))
        good = [int(satisfied(test, side.to_numpy()).sum()) for side in (both.expected, both.found)]
        words.append(f"{good[0]} of {len(both)} against {good[1]} of {len(both)}")
    if combined([evaluate(test, found).verdict for test in deciding]) != verdicts[1]:
        return None
    if not words or verdicts[0] not in map(combined, product(*options)):
        return None
    return f"rests on times ({'; '.join(words)})"


def _there(test: TestRule, *sides: Tables) -> bool:
    return all(METRICS[test.metric].table in tables for tables in sides)


def _side_by_side(test: TestRule, expected: Tables, found: Tables) -> pd.DataFrame | None:
    """Values of a test in both runs; None if they are not of the same rows."""
    a, b = (values_of(test, tables).reset_index(drop=True) for tables in (expected, found))
    if not a.drop(columns=VALUE).equals(b.drop(columns=VALUE)):
        return None
    return pd.DataFrame({"expected": a[VALUE].astype(float), "found": b[VALUE].astype(float)})


def _is_time(values: pd.Series) -> np.ndarray:
    """Whether each value is made of times: not 0 or infinite, as of a run that fails otherwise."""
    numbers = values.to_numpy()
    return np.isfinite(numbers) & (numbers > 0.0)


def _moved_beyond(test: TestRule, both: pd.DataFrame, limit: float) -> bool:
    """Whether a row has changed sides from further away, or counts for something else now."""
    if (_is_time(both.expected) != _is_time(both.found)).any():
        return True
    sides = [satisfied(test, values.to_numpy()) for values in (both.expected, both.found)]
    apart = distance("ratio", both.expected, both.found)
    return bool(((sides[0] != sides[1]) & (apart > limit)).any())


def _attainable(test: TestRule, values: pd.Series, limit: float) -> set[str]:
    """Verdicts of a test where rows close to its threshold may fall on either side."""
    threshold = pd.Series(test.threshold, values.index)
    close = _is_time(values) & (distance("ratio", values, threshold) <= limit)
    sure = int((satisfied(test, values.to_numpy()) & ~close).sum())
    return {answer(test.share, sure + more, len(values)) for more in range(int(close.sum()) + 1)}


def _timed_column(test: TestRule) -> str:
    metric = METRICS[test.metric]
    timing = declared()[metric.table].timing_columns
    return next(name for name in reversed(metric.columns) if name in timing)
