"""Tables about the preprint's claims, by the rules of config/claims.yaml.

Table claims has the verdicts, claims_tests the result of every test, claims_sensitivity the
verdicts under changed rules.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from study.tables.claims import verdicts
from study.tables.claims.metrics import VALUE, Tables
from study.tables.claims.rules import PARTS, READS, Added, ClaimRule, TestRule, load_claims
from study.tables.kit.declaration import Column, flag, number, table, text, timed
from study.tables.kit.declaration import table as declare

# Fields of a claim's rule that are columns of the table claims.
WORDS = {"source", "paper", "figure_or_table", "section", "shown", "text", "qualifiers"}
SAID = {"what", "metric", "decides", "compare", "threshold", "share"}
FOUND = ("satisfied", "of", "close", "least", "median", "most", "verdict")
ONE_OF = f"one of: {', '.join(verdicts.VERDICTS)}"
# Constructor of columns that depend on timing and are not compared.
skipped = partial(Column, timed=True, compared="skipped")
FACTORS = (0.5, 0.8, 1.25, 2.0)  # on thresholds
SHARES = (0.5, 0.6, 0.75, 0.9, 1.0)
MARGINS = (1.0, 1.25, 1.5, 2.0, 3.0, 5.0)  # margins of tests that compare times; 1 is no margin
SMALL = 10  # largest size r that counts as small
SPLITS = ("train", "test", "heldout")
VARIED = ("threshold", "share", "margin", "sizes", "splits", "scenes")
# Share of the rows whose verdict may differ between machines because it rests on a few runs.
FRAGILE = 0.01
_Rows = list[pd.DataFrame]
_Keep = Callable[[pd.Series], pd.Series]
_Variation = tuple[str, str, Sequence[TestRule], _Rows]  # what varies, how, the tests, their rows


@declare(
    title="Verdicts on the claims of the preprint",
    columns=(
        text("claim", "its identifier in config/claims.yaml"),
        text("source", "who claims it"),
        text("paper", "what the preprint says"),
        skipped("text", "measured", "range of what was measured, of the tests that decide"),
        timed(text("verdict", f"as published, {ONE_OF}", compared="exact")),
        skipped("text", "why", "all tests in words"),
        text("figure_or_table", "where to see it"),
        text("section", "section of the preprint"),
        text("shown", "figures of the preprint"),
        text("text", "the claim in our words"),
        text("qualifiers", "what a fair test has to keep"),
        skipped("text", "condition", "what the verdict depends on"),
        skipped("text", "measured_beyond", "the same of sound variants on well-posed scenes"),
        timed(text("verdict_beyond", "the verdict there", compared="exact")),
        skipped("text", "condition_beyond", "what it depends on"),
        skipped("text", "why_beyond", "all tests there in words"),
        skipped("text", "answer", "both verdicts in words"),
        text("history", "when and why the rules became what they are"),
    ),
    reads=READS,
    timed_cells=verdicts.by_rules(lambda rule, row: verdicts.timed_columns(rule)),
)
def claims(rules: Path, added: Added, **tables: pd.DataFrame) -> pd.DataFrame:
    """One row per claim, in the order of the file ``rules``; ``added`` is as in `load_claims`."""
    found = load_claims(rules, added)
    return pd.DataFrame([_row(name, rule, tables) for name, rule in found.items()])


def _row(name: str, rule: ClaimRule, tables: Tables) -> dict[str, Any]:
    published, beyond = _decided(rule.published, tables), _decided(rule.beyond, tables)
    return {
        "claim": name,
        **rule.model_dump(include=WORDS),
        **published,
        **{f"{key}_beyond": value for key, value in beyond.items()},
        "answer": f"as published it {published['verdict']}, beyond it {beyond['verdict']}",
        "history": " ".join(
            f"{change.date.isoformat()}{' (results were known)' * change.after_data}: "
            f"{change.reason}"
            for change in rule.changes
        ),
    }


def _decided(tests: Sequence[TestRule], tables: Tables) -> dict[str, str]:
    outcomes = [(test, verdicts.evaluate(test, tables)) for test in tests]
    deciding = [o for test, o in outcomes if test.decides]
    return {
        "measured": "; ".join(o.measured for o in deciding),
        "verdict": verdicts.combined([o.verdict for o in deciding]),
        "condition": "; ".join(o.condition for o in deciding if o.condition),
        "why": "; ".join(o.sentence for _, o in outcomes) + ".",
    }


def _timed_of_test(rule: ClaimRule, row: Any) -> set[str]:
    test = next(test for test in getattr(rule, row.part) if test.what == row.what)
    return {*FOUND} if test.timed else set()


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
        skipped("integer", "satisfied", "rows that satisfy the comparison"),
        skipped("integer", "of", "rows that are compared"),
        skipped("integer", "close", "of them, ratios of times within the margin"),
        skipped("number", "least", "smallest value; infinite for a run that failed"),
        skipped("number", "median", "their median"),
        skipped("number", "most", "largest value"),
        timed(text("verdict", f"of this test, {ONE_OF}", compared="exact")),
    ),
    reads=READS,
    timed_cells=verdicts.by_rules(_timed_of_test),
)
def claims_tests(rules: Path, added: Added, **tables: pd.DataFrame) -> pd.DataFrame:
    """One row per claim, part and test, in the order of the file ``rules``; see `claims`."""
    rows = [
        {"claim": name, "part": part, **test.model_dump(include=SAID), **_found(test, tables)}
        for name, rule in load_claims(rules, added).items()
        for part in PARTS
        for test in getattr(rule, part)
    ]
    return pd.DataFrame(rows)


def _found(test: TestRule, tables: Tables) -> dict[str, Any]:
    """Margin, counts, verdict and range of the values (None where there are no values)."""
    values = verdicts.values_of(test, tables)[VALUE].to_numpy(float)
    good, total = int(verdicts.satisfied(test, values).sum()), len(values)
    spread = (values.min(), np.median(values), values.max()) if total else (None, None, None)
    near, answer = int(verdicts.close(test, values).sum()), verdicts.answer_of(test, values)
    found = zip(FOUND, (good, total, near, *spread, answer), strict=True)
    return {"margin": test.factor if test.timed else None, **dict(found)}


@table(
    title="Verdicts under other rules",
    columns=(
        text("claim", "its identifier in config/claims.yaml"),
        text("part", f"tests that decide: {', '.join(PARTS)}"),
        text("varied", f"what is changed in all of them: {', '.join(VARIED)}"),
        text("variation", "how: factor, share, sizes, split, scene left out"),
        timed(text("verdict", ONE_OF, compared="exact", tolerance=FRAGILE)),
        timed(text("verdict_of_rules", "the verdict of the rules as they are", compared="exact")),
        timed(flag("same", "the two agree", compared="exact", tolerance=FRAGILE)),
    ),
    reads=READS,
    timed_cells=verdicts.timed_parts("verdict", "verdict_of_rules", "same"),
)
def claims_sensitivity(rules: Path, added: Added, **tables: pd.DataFrame) -> pd.DataFrame:
    """One row per claim of the file ``rules``, part and variation; see `claims`."""
    return sensitivity_rows(load_claims(rules, added), tables)


def sensitivity_rows(rules: Mapping[str, ClaimRule], tables: Tables) -> pd.DataFrame:
    """One row per claim, part and variation of the tests that decide the verdict.

    A variation is left out if a test has no rows; a split or filter also if it changes nothing.
    """
    made = []
    for claim, rule in rules.items():
        for part in PARTS:
            tests = [test for test in getattr(rule, part) if test.decides]
            if not tests:
                continue
            rows = [verdicts.values_of(test, tables) for test in tests]
            base = _verdict(tests, rows)
            for varied, variation, changed, kept in _variations(tests, rows, tables):
                if all(len(values) for values in (*rows, *kept)):
                    verdict = _verdict(changed, kept)
                    made.append((claim, part, varied, variation, verdict, base, verdict == base))
    names = ["claim", "part", "varied", "variation", "verdict", "verdict_of_rules", "same"]
    return pd.DataFrame(made, columns=names)


def _verdict(tests: Sequence[TestRule], rows: _Rows) -> str:
    values = [found[VALUE].to_numpy(float) for found in rows]
    return verdicts.combined(list(map(verdicts.answer_of, tests, values)))


def _with(test: TestRule, **changes: Any) -> TestRule:
    return test.model_copy(update=changes)


def _variations(tests: Sequence[TestRule], rows: _Rows, tables: Tables) -> Iterator[_Variation]:
    """Variations: tests with other limits, on a subset of their rows, or on another split."""
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
            yield "splits", split, changed, [verdicts.values_of(test, tables) for test in changed]
    scenes = dict.fromkeys(s for values in rows if "scene" in values for s in values.scene)
    others = {f"without {s}": lambda values, s=s: values != s for s in scenes}
    yield from _kept(tests, rows, "scenes", "scene", others)


def _kept(
    tests: Sequence[TestRule], rows: _Rows, varied: str, column: str, keeps: Mapping[str, _Keep]
) -> Iterator[_Variation]:
    """Variations that restrict ``rows`` by one of the filters ``keeps`` on ``column``."""
    for name, keep in keeps.items():
        kept = [values[keep(values[column])] if column in values else values for values in rows]
        if sum(map(len, kept)) < sum(map(len, rows)):
            yield varied, name, tests, kept
