"""Tables about the preprint's claims, by the rules of config/claims.yaml."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from study.artifact.reads import ProjectFile, TableOf
from study.tables.claims.metrics import METRICS, VALUE, Tables, filtered
from study.tables.claims.rules import PARTS, READS, Added, ClaimRule, TestRule, load_claims
from study.tables.kit.declaration import Column, TimedCells, flag, number, table, text, timed
from study.tables.kit.declaration import table as declare
from study.tables.kit.results import BOTH, measured

VERDICTS = HOLDS, FAILS, DEPENDS, MACHINE, UNDECIDED, UNTESTED = (
    "holds", "does not hold", "depends", "depends on the machine", "cannot be decided",
    "not tested",
)  # fmt: skip
NOT_DECIDED = UNDECIDED, UNTESTED
RULES = "config/claims.yaml"
RERUNS = "reduced_reruns"
RECORDED = "config/reference/replication/claims.csv"
COMMITS = "config/reference/replication/commits.csv"
MEASURED = [f"{name}{suffix}" for suffix in PARTS.values() for name in ("verdict", "measured")]


def values_of(test: TestRule, tables: Tables) -> pd.DataFrame:
    """Rows that ``test`` selects: columns scene, group ..., and `VALUE`, the metric of the test."""
    return METRICS[test.metric].values(tables, dict(test.where), test.accuracy)


def compared(test: TestRule, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether each value satisfies ``test``; whether it is a time too close to the threshold."""
    passed = values >= test.threshold if test.compare == ">=" else values <= test.threshold
    ratio = METRICS[test.metric].ratio
    apart = ratio(values) / ratio(np.array(test.threshold))
    return passed, (apart > 1.0 / test.factor) & (apart < test.factor)


def answer(share: float, good: int, total: int) -> str:
    """Verdict of a test of which ``good`` rows of ``total`` rows satisfy the comparison.

    The verdict is "holds" if at least a fraction ``share`` of rows satisfies the comparison, "does
    not hold" if this fraction violates it, "cannot be decided" without rows, and else "depends".
    """
    if total == 0:
        return UNDECIDED
    if good >= share * total:
        return HOLDS
    return FAILS if total - good >= share * total else DEPENDS


def answer_of(test: TestRule, values: np.ndarray) -> str:
    """Verdict of ``test``; "depends on the machine" if values near the threshold may change it."""
    passed, near = compared(test, values)
    sure, most = int((passed & ~near).sum()), int((passed | near).sum())
    answers = {answer(test.share, good, len(values)) for good in range(sure, most + 1)}
    return answers.pop() if len(answers) == 1 else MACHINE


def outcome(test: TestRule, tables: Tables) -> dict[str, Any]:
    """Evaluate ``test`` on ``tables``: return its cells of table claims_tests, and three texts.

    measured : text with the range of the values
    sentence : text with the number of rows that satisfy the comparison
    condition : text with this number for each value of the test's column ``by``; empty unless the
        verdict is "depends" or "depends on the machine"
    """
    rows = values_of(test, tables)
    values = rows[VALUE].to_numpy(float)
    passed, close = compared(test, values)
    good, near, total = int(passed.sum()), int(close.sum()), len(values)
    verdict = answer_of(test, values)
    made: dict[str, Any] = dict.fromkeys(("least", "median", "most"))
    made |= {"satisfied": good, "of": total, "close": near, "verdict": verdict, "condition": ""}
    if total == 0:
        why = "this configuration has no rows for it"
        where = {k: v for k, v in test.where.items() if k != "r"}
        if test.metric == "rerun_error" and len(filtered(tables[RERUNS], where)):
            why = "the snapshots have too small a numerical rank for every basis size"
        return made | {"measured": "no data", "sentence": f"{test.what}: {why}"}
    spread = _range(values)
    limit = f"{'at least' if test.compare == '>=' else 'at most'} {test.threshold:g}"
    beside = f"{near} of {total} within a factor {test.factor:g} of the limit"
    sentence = f"{test.what}: {good} of {total} {limit} (measured {spread})"
    if verdict in (DEPENDS, MACHINE):
        made["condition"] = f"{test.what}, {limit}: {_broken_down(test, rows, passed)}"
    if verdict == MACHINE:
        made["condition"] += f" (measured {spread}; {beside} decide nothing)"
    ends = {"least": values.min(), "median": np.median(values), "most": values.max()}
    sentence += f", {beside}" if near else ""
    return made | ends | {"measured": spread, "sentence": sentence}


def _broken_down(test: TestRule, rows: pd.DataFrame, passed: np.ndarray) -> str:
    """Text with the number of rows that satisfy ``test``, for each value of its column ``by``."""
    if test.by is None or test.by not in rows:
        return f"{int(passed.sum())} of {len(passed)}"
    counts = pd.Series(passed).groupby(rows[test.by].to_numpy(), sort=False)
    parts = [f"{value} {int(part.sum())} of {len(part)}" for value, part in counts]
    return ", ".join(parts).replace("_", " ")


def _range(values: np.ndarray) -> str:
    """Text with the least and largest of ``values``, and the median if there are at least three."""
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
    """Verdict of a claim: the first of this list that a test has, or "not tested" without tests.

    "cannot be decided", "does not hold", "depends on the machine", "depends", "holds"
    """
    order = (UNDECIDED, FAILS, MACHINE, DEPENDS, HOLDS)
    return next((verdict for verdict in order if verdict in verdicts), UNTESTED)


def timed_columns(rule: ClaimRule) -> set[str]:
    """Columns of table claims that depend on measured times in the row of the claim ``rule``."""
    found: set[str] = set()
    for part, suffix in PARTS.items():
        timed = [test for test in getattr(rule, part) if test.timed]
        if timed:
            found.add(f"why{suffix}")
        if any(test.decides for test in timed):
            found |= {f"{name}{suffix}" for name in ("measured", "verdict", "condition")}
            found |= {f"verdict{suffix}_both", "answer"}
    return found


def by_rules(timed: Callable[[ClaimRule, Any], set[str]]) -> TimedCells:
    """Return a function for `Table.timed_cells` that calls ``timed`` with each row and its rule."""

    def timed_cells(table: pd.DataFrame, **files: Path) -> list[set[str]]:
        rules = load_claims(files["rules"])
        return [timed(rules[row.claim], row) for row in table.itertuples()]

    return timed_cells


def timed_parts(*cells: str) -> TimedCells:
    """Return a function for `Table.timed_cells`: ``cells`` depend on times if the verdict does."""
    return by_rules(
        lambda rule, row: {*cells} if f"verdict{PARTS[row.part]}" in timed_columns(rule) else set()
    )


ONE_OF = f"one of: {', '.join(VERDICTS)}"
CLAIM = text("claim", "name of the claim in config/claims.yaml")
# Make columns that may depend on times: verdicts, and texts that are not compared between runs.
judged = partial(text, timed=True, compared="exact")
skipped = partial(Column, timed=True, compared="skipped")
FACTORS = (0.5, 0.8, 1.25, 2.0)  # table claims_sensitivity multiplies thresholds by these
SHARES = (0.5, 0.6, 0.75, 0.9, 1.0)
MARGINS = (1.0, 1.25, 1.5, 2.0, 3.0, 5.0)  # tried values of `TestRule.margin`; 1: no margin
SMALL = 10  # claims_sensitivity repeats tests with sizes r <= this only, and with larger r only
SPLITS = ("train", "test", "heldout")
VARIED = ("threshold", "share", "margin", "sizes", "splits", "scenes", "measure")
# Share of verdicts in claims_sensitivity (some rest on few runs) that may differ between machines.
FRAGILE = 0.01
_Rows = list[pd.DataFrame]
_Keep = Callable[[pd.Series], pd.Series]
_Variation = tuple[str, str, Sequence[TestRule], _Rows]  # (one of `VARIED`, change, tests, rows)


@declare(
    title="Verdicts on the claims of the preprint",
    columns=(
        CLAIM,
        text("source", "authors of the claim"),
        text("paper", "statement of the preprint"),
        skipped("text", "measured", "range of the values in the tests that decide"),
        judged("verdict", f"verdict as published, {ONE_OF}"),
        skipped("text", "why", "all tests as published, in words"),
        text("figure_or_table", "figure or table with the result"),
        text("section", "section of the preprint"),
        text("shown", "figures of the preprint"),
        text("text", "the claim in our words"),
        text("qualifiers", "conditions that a fair test must respect"),
        skipped("text", "condition", "rows that satisfy a test that depends, broken down"),
        skipped("text", "measured_beyond", "measured, for the improved method and its scenes"),
        judged("verdict_beyond", "verdict for the improved method, well-posed scenes"),
        judged("verdict_both", "verdict as published, if the deformation error counts, too"),
        judged("verdict_beyond_both", "verdict_beyond, if the deformation error counts, too"),
        skipped("text", "condition_beyond", "condition, for verdict_beyond"),
        skipped("text", "why_beyond", "all tests for verdict_beyond, in words"),
        skipped("text", "answer", "verdict and verdict_beyond, in words"),
        text("history", "dates and reasons of changes to the rules"),
    ),
    reads=READS,
    timed_cells=by_rules(lambda rule, row: timed_columns(rule)),
)
def claims(rules: Path, added: Added, **tables: pd.DataFrame) -> pd.DataFrame:
    """One row per claim of file ``rules``; ``added``: values for its sets (see `load_claims`)."""
    found = load_claims(rules, added)
    return pd.DataFrame([_row(name, rule, tables) for name, rule in found.items()])


def _row(name: str, rule: ClaimRule, tables: Tables) -> dict[str, Any]:
    made, both = {"claim": name, **dict(rule)}, with_both(tables)
    for part, suffix in PARTS.items():
        tests = getattr(rule, part)
        made |= {f"{key}{suffix}": text for key, text in _decided(tests, tables).items()}
        made[f"verdict{suffix}_both"] = _decided(tests, both)["verdict"]
    history = [
        f"{change.date.isoformat()}{' (results were known)' * change.after_data}: {change.reason}"
        for change in rule.changes
    ]
    answer = f"as published it {made['verdict']}, beyond it {made['verdict_beyond']}"
    return made | {"answer": answer, "history": " ".join(history)}


def _decided(tests: Sequence[TestRule], tables: Tables) -> dict[str, str]:
    outcomes = [outcome(test, tables) for test in tests]
    deciding = [found for test, found in zip(tests, outcomes, strict=True) if test.decides]
    return {
        "measured": "; ".join(found["measured"] for found in deciding),
        "verdict": combined([found["verdict"] for found in deciding]),
        "condition": "; ".join(filter(None, (found["condition"] for found in deciding))),
        "why": "; ".join(found["sentence"] for found in outcomes) + ".",
    }


def _timed_of_test(rule: ClaimRule, row: Any) -> set[str]:
    timed = any(test.timed for test in getattr(rule, row.part) if test.what == row.what)
    return {*claims_tests.timing_columns} if timed else set()


@table(
    title="Tests of the claims",
    columns=(
        CLAIM,
        text("part", f"verdict that the test is for: {', '.join(PARTS)}"),
        text("what", "compared quantity, method and scenes"),
        text("metric", "name of the compared metric"),
        flag("decides", "the test decides the verdict; other tests are for information"),
        text("compare", "comparison with the threshold"),
        number("threshold", "limit with which values are compared"),
        number("share", "share of the rows that must agree for a clear answer"),
        number("margin", "factor of the threshold within which a ratio of times decides nothing"),
        skipped("integer", "satisfied", "number of rows that satisfy the comparison"),
        skipped("integer", "of", "number of compared rows"),
        skipped("integer", "close", "number of ratios of times within the margin"),
        skipped("number", "least", "smallest value; inf: a run blew up"),
        skipped("number", "median", "median of the values"),
        skipped("number", "most", "largest value"),
        judged("verdict", f"verdict of this test, {ONE_OF}"),
    ),
    reads=READS,
    timed_cells=by_rules(_timed_of_test),
)
def claims_tests(rules: Path, added: Added, **tables: pd.DataFrame) -> pd.DataFrame:
    """One row per claim, kind of verdict (`PARTS`) and test; ``added``: see table `claims`."""
    rows = [
        {"claim": name, "part": part, **dict(test), **outcome(test, tables)}
        | {"margin": test.factor if test.timed else None}
        for name, rule in load_claims(rules, added).items()
        for part in PARTS
        for test in getattr(rule, part)
    ]
    return pd.DataFrame(rows)


@table(
    title="Verdicts under other rules",
    columns=(
        CLAIM,
        text("part", f"verdict that is repeated: {', '.join(PARTS)}"),
        text("varied", f"property changed in all tests that decide: {', '.join(VARIED)}"),
        text("variation", "change: factor, share, sizes, split or scene left out"),
        judged("verdict", f"verdict after the change, {ONE_OF}", tolerance=FRAGILE),
        judged("verdict_of_rules", "verdict of the unchanged rules"),
        timed(flag("same", "the two verdicts agree", compared="exact", tolerance=FRAGILE)),
    ),
    reads=READS,
    timed_cells=timed_parts("verdict", "verdict_of_rules", "same"),
)
def claims_sensitivity(rules: Path, added: Added, **tables: pd.DataFrame) -> pd.DataFrame:
    """One row per claim, kind of verdict (`PARTS`) and variation of its deciding tests.

    A variation is omitted if a test has no rows or, for sizes, splits and scenes, loses none.
    """
    made = []
    for (claim, rule), part in product(load_claims(rules, added).items(), PARTS):
        tests = [test for test in getattr(rule, part) if test.decides]
        rows = [values_of(test, tables) for test in tests]
        base = _verdict(tests, rows)
        for varied, variation, changed, kept in _variations(tests, rows, tables) if tests else ():
            if all(len(values) for values in (*rows, *kept)):
                verdict = _verdict(changed, kept)
                made.append((claim, part, varied, variation, verdict, base, verdict == base))
    return pd.DataFrame(made, columns=claims_sensitivity.column_names)


def _verdict(tests: Sequence[TestRule], rows: _Rows) -> str:
    values = [found[VALUE].to_numpy(float) for found in rows]
    return combined(list(map(answer_of, tests, values)))


def _with(test: TestRule, **changes: Any) -> TestRule:
    return test.model_copy(update=changes)


def _variations(tests: Sequence[TestRule], rows: _Rows, tables: Tables) -> Iterator[_Variation]:
    """Yield ``tests`` with each change of `VARIED`, such as another threshold or fewer scenes."""
    for factor in FACTORS:
        changed = [_with(test, threshold=factor * test.threshold) for test in tests]
        yield "threshold", f"x {factor:g}", changed, rows
    for share in SHARES:
        yield "share", f"{share:g}", [_with(test, share=share) for test in tests], rows
    for margin in MARGINS if any(test.timed for test in tests) else ():
        changed = [_with(test, margin=margin) if test.timed else test for test in tests]
        yield "margin", f"{margin:g}", changed, rows
    sizes = {f"r up to {SMALL}": lambda r: ~(r > SMALL), f"r above {SMALL}": lambda r: r > SMALL}
    yield from _kept(tests, rows, "sizes", "r", sizes)
    for split in SPLITS:
        changed = [
            _with(test, where={**test.where, "split": (split,)}) if "split" in test.where else test
            for test in tests
        ]
        if changed != list(tests):
            yield "splits", split, changed, [values_of(test, tables) for test in changed]
    scenes = dict.fromkeys(s for values in rows if "scene" in values for s in values.scene)
    others = {f"without {s}": lambda values, s=s: values != s for s in scenes}
    yield from _kept(tests, rows, "scenes", "scene", others)
    if any(METRICS[test.metric].table == RERUNS for test in tests):
        both = with_both(tables)
        yield "measure", BOTH, tests, [values_of(test, both) for test in tests]


def with_both(tables: Tables) -> Tables:
    """Return ``tables`` in which the error of a reduced run is the larger one of its two errors."""
    runs = tables.get(RERUNS, pd.DataFrame())
    return {**tables, RERUNS: measured(runs, BOTH)} if len(runs) else tables


def _kept(
    tests: Sequence[TestRule], rows: _Rows, varied: str, column: str, keeps: Mapping[str, _Keep]
) -> Iterator[_Variation]:
    """Yield ``tests`` with fewer ``rows``, for each function of ``column`` that leaves out any."""
    for name, keep in keeps.items():
        kept = [values[keep(values[column])] if column in values else values for values in rows]
        if sum(map(len, kept)) < sum(map(len, rows)):
            yield varied, name, tests, kept


@table(
    title="Verdicts on other scenes by the same rules",
    columns=(
        text("replication", "name of the replication in config/reference/replication/commits.csv"),
        CLAIM,
        text("part", f"kind of the verdict: {', '.join(PARTS)}"),
        judged("verdict", f"verdict of this study, {ONE_OF}"),
        text("verdict_replication", "recorded verdict on the other scenes"),
        timed(flag("decidable", "neither verdict is undecided or not tested", compared="exact")),
        timed(flag("same", "the two verdicts agree", compared="exact")),
        skipped("text", "measured", "range of the values in the tests that decide"),
        text("measured_replication", "range of these values on the other scenes"),
        flag("rules_unchanged", "the record was decided by the present rules"),
        text("date", "day of the record"),
        text("frozen", "commit with rules, scenes and code, before the first run"),
        text("recorded", "commit with the record"),
    ),
    reads={
        "claims": TableOf("claims"),
        "rules": ProjectFile(RULES),
        "recorded": ProjectFile(RECORDED),
        "commits": ProjectFile(COMMITS),
    },
    timed_cells=timed_parts("verdict", "decidable", "same", "measured"),
)
def replication(claims: pd.DataFrame, rules: Path, recorded: Path, commits: Path) -> pd.DataFrame:
    """Verdicts of ``claims`` and ``recorded`` ones; one row per replication, claim and part."""
    others = pd.read_csv(recorded).merge(pd.read_csv(commits, dtype=str), on="replication")
    both = others.merge(claims, on="claim", suffixes=("_replication", ""))
    fingerprints = {claim: rule.fingerprint for claim, rule in load_claims(rules).items()}
    both["rules_unchanged"] = both.rules == both.claim.map(fingerprints)
    rows = []
    for part, suffix in PARTS.items():
        own = both.assign(part=part)
        for name in ("verdict", "measured"):
            own[name] = both[f"{name}{suffix}"]
            own[f"{name}_replication"] = both[f"{name}{suffix}_replication"]
        decidable = ~own[["verdict", "verdict_replication"]].isin(NOT_DECIDED).any(axis=1)
        rows.append(own.assign(same=own.verdict == own.verdict_replication, decidable=decidable))
    return pd.concat(rows, ignore_index=True)
