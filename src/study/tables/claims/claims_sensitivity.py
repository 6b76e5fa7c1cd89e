"""Table claims_sensitivity: which verdicts stand when a rule of config/claims.yaml changes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import pandas as pd

from study.tables.claims.claims import timed_columns
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
from study.tables.claims.verdicts import VERDICTS, answer_of, combined, values_of
from study.tables.kit.declaration import compared, flag, table, text, timed

FACTORS = (0.5, 0.8, 1.25, 2.0)  # on thresholds
SHARES = (0.5, 0.6, 0.75, 0.9, 1.0)
MARGINS = (1.0, 1.25, 1.5, 2.0, 3.0, 5.0)  # of ratios of times; 1: each of them decides
SMALL = 10  # largest of the small sizes
SPLITS = ("train", "test", "heldout")
VARIED = ("threshold", "share", "margin", "sizes", "splits", "scenes")
# Share of the variations whose verdict a few runs decide.
FRAGILE = 0.01

_Rows = list[pd.DataFrame]
_Keep = Callable[[pd.Series], pd.Series]
_Variation = tuple[str, str, Sequence[TestRule], _Rows]  # what, how, the tests and their rows


def _timed_cells(table: pd.DataFrame, **files: Path) -> list[set[str]]:
    loaded = load_claims(files["rules"])
    cells = {"verdict", "verdict_of_rules", "same"}
    return [
        cells if f"verdict{PARTS[part]}" in timed_columns(loaded[claim]) else set()
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
    reads=READS,
    timed_cells=_timed_cells,
)
def claims_sensitivity(
    rules: Path, added: Added = NONE_ADDED, **tables: pd.DataFrame
) -> pd.DataFrame:
    """One row per claim of the file ``rules``, part and variation; see `claims`."""
    return sensitivity_rows(load_claims(rules, added), tables)


def sensitivity_rows(rules: Mapping[str, ClaimRule], tables: Tables) -> pd.DataFrame:
    """A row for every claim, part and variation of its deciding tests that can be made.

    A variation that leaves a test without rows, or no test another, is none.
    """
    made = []
    for claim, rule in rules.items():
        for part in PARTS:
            tests = [test for test in getattr(rule, part) if test.decides]
            rows = [values_of(test, tables) for test in tests]
            base = _verdict(tests, rows)
            for varied, variation, changed, kept in _variations(tests, rows, tables):
                if all(len(values) for values in (*rows, *kept)):
                    verdict = _verdict(changed, kept)
                    made.append((claim, part, varied, variation, verdict, base, verdict == base))
    names = ["claim", "part", "varied", "variation", "verdict", "verdict_of_rules", "same"]
    return pd.DataFrame(made, columns=names)


def _verdict(tests: Sequence[TestRule], rows: _Rows) -> str:
    found = zip(tests, rows, strict=True)
    return combined([answer_of(test, values[VALUE].to_numpy(float)) for test, values in found])


def _variations(tests: Sequence[TestRule], rows: _Rows, tables: Tables) -> Iterator[_Variation]:
    """The tests with other numbers, then on a part of their rows, or on those of another split."""
    for factor in FACTORS:
        changed = [_changed(t, threshold=factor * t.threshold) for t in tests]
        yield "threshold", f"x {factor:g}", changed, rows
    for share in SHARES:
        yield "share", f"{share:g}", [_changed(test, share=share) for test in tests], rows
    for margin in MARGINS if any(test.timed for test in tests) else ():
        changed = [_changed(test, margin=margin) if test.timed else test for test in tests]
        yield "margin", f"{margin:g}", changed, rows
    sizes = {f"r up to {SMALL}": lambda r: ~(r > SMALL), f"r above {SMALL}": lambda r: r > SMALL}
    yield from _kept(tests, rows, "sizes", "r", sizes)
    for split in SPLITS:
        changed = [_of_split(test, split) for test in tests]
        if changed != list(tests):
            yield "splits", split, changed, [values_of(test, tables) for test in changed]
    scenes = dict.fromkeys(s for values in rows if "scene" in values for s in values.scene)
    others = {f"without {scene}": _other_than(scene) for scene in scenes}
    yield from _kept(tests, rows, "scenes", "scene", others)


def _kept(
    tests: Sequence[TestRule], rows: _Rows, varied: str, column: str, keeps: Mapping[str, _Keep]
) -> Iterator[_Variation]:
    """The tests on the ``rows`` whose ``column`` a filter keeps, where it drops some."""
    for name, keep in keeps.items():
        kept = [values[keep(values[column])] if column in values else values for values in rows]
        if sum(map(len, kept)) < sum(map(len, rows)):
            yield varied, name, tests, kept


def _other_than(scene: str) -> _Keep:
    return lambda scenes: scenes != scene


def _changed(test: TestRule, **changes: float) -> TestRule:
    return test.model_copy(update=changes)


def _of_split(test: TestRule, split: str) -> TestRule:
    """Repeat the test over another split of the snapshots, where it is about one."""
    if "split" not in test.where:
        return test
    return test.model_copy(update={"where": {**test.where, "split": (split,)}})
