"""Fragility of verdicts: the same tests with other thresholds, shares, rows."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import pandas as pd

from study.tables.claims.rows import VALUE, Tables
from study.tables.claims.rules import ClaimRule, TestRule
from study.tables.claims.verdicts import answer_of, combined, values_of

FACTORS = (0.5, 0.8, 1.25, 2.0)  # on thresholds
SHARES = (0.5, 0.6, 0.75, 0.9, 1.0)
MARGINS = (1.0, 1.25, 1.5, 2.0, 3.0, 5.0)  # of ratios of times; 1: each of them decides
SMALL = 10  # largest of the small sizes
SPLITS = ("train", "test", "heldout")
PARTS = ("published", "beyond")
VARIED = ("threshold", "share", "margin", "sizes", "splits", "scenes")

_Tests = Sequence[TestRule]
_Rows = Sequence[pd.DataFrame]
_Keep = Callable[[pd.DataFrame], pd.Series]


def sensitivity_rows(rules: Mapping[str, ClaimRule], tables: Tables) -> pd.DataFrame:
    """A row for every claim, part and variation of its deciding tests that can be made.

    A variation that leaves a test without rows, or no test another, is none.
    """
    rows = []
    for claim, rule in rules.items():
        for part in PARTS:
            tests = [test for test in getattr(rule, part) if test.decides]
            base = _verdict(tests, [values_of(test, tables) for test in tests])
            for varied, value, verdict in _variations(tests, tables):
                row = (claim, part, varied, value, verdict, base, verdict == base)
                rows.append(row)
    names = ["claim", "part", "varied", "variation", "verdict", "verdict_of_rules", "same"]
    return pd.DataFrame(rows, columns=names)


def _verdict(tests: _Tests, rows: _Rows) -> str:
    found = zip(tests, rows, strict=True)
    return combined([answer_of(test, values[VALUE].to_numpy(float)) for test, values in found])


def _variations(tests: _Tests, tables: Tables) -> Iterator[tuple[str, str, str]]:
    rows = [values_of(test, tables) for test in tests]
    if not all(len(values) for values in rows):
        return
    for factor in FACTORS:
        changed = [t.model_copy(update={"threshold": factor * t.threshold}) for t in tests]
        yield "threshold", f"x {factor:g}", _verdict(changed, rows)
    for share in SHARES:
        changed = [test.model_copy(update={"share": share}) for test in tests]
        yield "share", f"{share:g}", _verdict(changed, rows)
    if any(test.timed for test in tests):
        for margin in MARGINS:
            changed = [_within(test, margin) for test in tests]
            yield "margin", f"{margin:g}", _verdict(changed, rows)
    yield from _kept(tests, rows, "sizes", _sizes())
    for split in SPLITS:
        changed = [_of_split(test, split) for test in tests]
        if changed != list(tests):
            found = [values_of(test, tables) for test in changed]
            if all(len(values) for values in found):
                yield "splits", split, _verdict(changed, found)
    scenes = dict.fromkeys(s for values in rows if "scene" in values for s in values.scene)
    yield from _kept(tests, rows, "scenes", {f"without {s}": _other_than(s) for s in scenes})


def _kept(
    tests: _Tests, rows: _Rows, varied: str, filters: Mapping[str, _Keep]
) -> Iterator[tuple[str, str, str]]:
    """Verdicts over the rows that a filter keeps, where it drops some and leaves some."""
    for name, keep in filters.items():
        kept = [values[keep(values)] for values in rows]
        dropped = sum(map(len, rows)) - sum(map(len, kept))
        if dropped and all(len(values) for values in kept):
            yield varied, name, _verdict(tests, kept)


def _sizes() -> dict[str, _Keep]:
    """Small and large sizes; a test without sizes keeps its rows."""

    def sized(large: bool) -> _Keep:
        return lambda rows: (rows.r > SMALL) == large if "r" in rows else rows[VALUE].map(_always)

    return {f"r up to {SMALL}": sized(False), f"r above {SMALL}": sized(True)}


def _other_than(scene: str) -> _Keep:
    return lambda rows: rows.scene != scene if "scene" in rows else rows[VALUE].map(_always)


def _always(value: float) -> bool:
    return True


def _within(test: TestRule, margin: float) -> TestRule:
    return test.model_copy(update={"margin": margin}) if test.timed else test


def _of_split(test: TestRule, split: str) -> TestRule:
    """Repeat the test over another split of the snapshots, where it is about one."""
    if "split" not in test.where:
        return test
    return test.model_copy(update={"where": {**test.where, "split": (split,)}})
