"""Verdicts on claims: evaluation of the tests of a claim and combination of their results."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from study.artifact.reads import ProjectFile, TableOf
from study.tables.claims.metrics import METRICS, VALUE, Tables, filtered
from study.tables.claims.rules import PARTS, ClaimRule, TestRule, load_claims
from study.tables.kit.declaration import TimedCells, flag, table, text, timed

VERDICTS = HOLDS, FAILS, DEPENDS, MACHINE, UNDECIDED, UNTESTED = (
    "holds", "does not hold", "depends", "depends on the machine", "cannot be decided",
    "not tested",
)  # fmt: skip
RULES = "config/claims.yaml"
RECORDED = "config/reference/replication/claims.csv"
MEASURED = [f"{name}{suffix}" for suffix in PARTS.values() for name in ("verdict", "measured")]


@dataclass(frozen=True)
class Outcome:
    """Result of one test.

    verdict : one of `VERDICTS`; "cannot be decided" if nothing can be compared, "depends on the
        machine" if ratios of times close to the threshold decide
    measured : range of the values, in words
    sentence : number of rows that satisfy the comparison, in words
    condition : if the verdict depends, that number for each value of the column ``by`` of the test
    """

    verdict: str
    measured: str
    sentence: str
    condition: str = ""


def values_of(test: TestRule, tables: Tables) -> pd.DataFrame:
    """Labels and a value for each row of ``tables`` that ``test`` compares."""
    return METRICS[test.metric].values(tables, dict(test.where), test.accuracy)


def satisfied(test: TestRule, values: np.ndarray) -> np.ndarray:
    """Boolean array: whether each of ``values`` satisfies the comparison of ``test``."""
    return values >= test.threshold if test.compare == ">=" else values <= test.threshold


def close(test: TestRule, values: np.ndarray) -> np.ndarray:
    """Boolean array: whether each value is a ratio of times within the margin of the threshold."""
    ratio = METRICS[test.metric].ratio
    apart = ratio(values) / ratio(np.array(test.threshold))
    return (apart > 1.0 / test.factor) & (apart < test.factor)


def answer(share: float, good: int, total: int) -> str:
    """Verdict if ``good`` of ``total`` rows satisfy a test and a fraction ``share`` must agree."""
    if total == 0:
        return UNDECIDED
    if good >= share * total:
        return HOLDS
    return FAILS if total - good >= share * total else DEPENDS


def answer_of(test: TestRule, values: np.ndarray) -> str:
    """Verdict of ``test``; `MACHINE` if it depends on the values close to the threshold."""
    near = close(test, values)
    sure, total = int((satisfied(test, values) & ~near).sum()), len(values)
    answers = {answer(test.share, sure + more, total) for more in range(int(near.sum()) + 1)}
    return answers.pop() if len(answers) == 1 else MACHINE


def evaluate(test: TestRule, tables: Tables) -> Outcome:
    """Compare the rows of ``tables`` that ``test`` selects with its threshold."""
    rows = values_of(test, tables)
    values = rows[VALUE].to_numpy(float)
    if len(values) == 0:
        why = "nothing to compare in this configuration"
        where = {k: v for k, v in test.where.items() if k != "r"}
        if test.metric == "rerun_error" and len(filtered(tables["reduced_reruns"], where)):
            why = "no size can run, the numerical rank allows none"
        return Outcome(UNDECIDED, "no data", f"{test.what}: {why}")
    passed = satisfied(test, values)
    good, total = int(passed.sum()), len(values)
    spread = _range(values)
    sign = "at least" if test.compare == ">=" else "at most"
    sentence = f"{test.what}: {good} of {total} {sign} {test.threshold:g} (measured {spread})"
    near = int(close(test, values).sum())
    beside = f"{near} of {total} within a factor {test.factor:g} of it" if near else ""
    sentence += f", {beside}" if beside else ""
    verdict = answer_of(test, values)
    condition = ""
    if verdict in (DEPENDS, MACHINE):
        condition = f"{test.what}, {sign} {test.threshold:g}: {_broken_down(test, rows, passed)}"
    if verdict == MACHINE:
        condition += f" (measured {spread}; {beside}, which decides nothing)"
    return Outcome(verdict, spread, sentence, condition)


def _broken_down(test: TestRule, rows: pd.DataFrame, passed: np.ndarray) -> str:
    """Text with the number of rows that satisfy the test for each value of its column ``by``."""
    if test.by is None or test.by not in rows:
        return f"{int(passed.sum())} of {len(passed)}"
    counts = pd.Series(passed).groupby(rows[test.by].to_numpy(), sort=False)
    parts = [f"{value} {int(part.sum())} of {len(part)}" for value, part in counts]
    return ", ".join(parts).replace("_", " ")


def _range(values: np.ndarray) -> str:
    """Text with the smallest and largest value, and the median of three or more values."""
    low, high = _text(values.min()), _text(values.max())
    if low == high:
        return low
    middle = f", median {_text(float(np.median(values)))}" if len(values) > 2 else ""
    return f"{low} to {high}{middle}"


def _text(value: float) -> str:
    if np.isinf(value):
        return "blow-up"
    if 100.0 <= abs(value) < 1e5:
        return f"{float(f'{value:.2g}'):.0f}"
    return f"{value:.2g}"


def combined(verdicts: Sequence[str]) -> str:
    """Verdict of a claim whose tests have ``verdicts``: it holds if all of them hold.

    Without a test that decides it is not tested.
    """
    if not verdicts:
        return UNTESTED
    for verdict in (UNDECIDED, FAILS, MACHINE, DEPENDS):
        if verdict in verdicts:
            return verdict
    return HOLDS


def timed_columns(rule: ClaimRule) -> set[str]:
    """Columns in the row of a claim that depend on measured times, by its ``rule``."""
    found: set[str] = set()
    for part, suffix in PARTS.items():
        timed = [test for test in getattr(rule, part) if test.timed]
        if timed:
            found.add(f"why{suffix}")
        if any(test.decides for test in timed):
            found |= {f"{name}{suffix}" for name in ("measured", "verdict", "condition")}
            found.add("answer")
    return found


def by_rules(timed: Callable[[ClaimRule, Any], set[str]]) -> TimedCells:
    """Function for `Table.timed_cells` that calls ``timed`` with each row and its claim's rule."""

    def timed_cells(table: pd.DataFrame, **files: Path) -> list[set[str]]:
        rules = load_claims(files["rules"])
        return [timed(rules[row.claim], row) for row in table.itertuples()]

    return timed_cells


def timed_parts(*cells: str) -> TimedCells:
    """Function that marks ``cells`` as timed columns in rows whose verdict depends on timing."""
    return by_rules(
        lambda rule, row: {*cells} if f"verdict{PARTS[row.part]}" in timed_columns(rule) else set()
    )


@table(
    title="Verdicts on another sample of the scenes, by the same rules",
    columns=(
        text("claim", "its identifier in config/claims.yaml"),
        text("part", f"which verdict: {', '.join(PARTS)}"),
        timed(text("verdict", f"of this study, one of: {', '.join(VERDICTS)}", compared="exact")),
        text("verdict_replication", "of config/replication.yaml, recorded"),
        timed(flag("same", "the two agree", compared="exact")),
        timed(text("measured", "range of the tests that decide", compared="skipped")),
        text("measured_replication", "the same range there"),
        flag("rules_unchanged", "the rules are those by which the record was decided"),
        text("date", "day of the record"),
    ),
    reads={
        "claims": TableOf("claims"),
        "rules": ProjectFile(RULES),
        "recorded": ProjectFile(RECORDED),
    },
    timed_cells=timed_parts("verdict", "same", "measured"),
)
def replication(claims: pd.DataFrame, rules: Path, recorded: Path) -> pd.DataFrame:
    """One row per claim in both ``claims`` and the file ``recorded``, and part of the claim."""
    loaded = load_claims(rules)
    both = claims.merge(pd.read_csv(recorded), on="claim", suffixes=("", "_replication"))
    unchanged = [
        loaded[claim].fingerprint == rule
        for claim, rule in zip(both.claim, both.rules, strict=True)
    ]
    both["rules_unchanged"] = unchanged
    rows = []
    for part, suffix in PARTS.items():
        own = both[["claim", "rules_unchanged", "date"]].assign(part=part)
        for name in ("verdict", "measured"):
            own[name] = both[f"{name}{suffix}"]
            own[f"{name}_replication"] = both[f"{name}{suffix}_replication"]
        rows.append(own.assign(same=own.verdict == own.verdict_replication))
    return pd.concat(rows, ignore_index=True)
