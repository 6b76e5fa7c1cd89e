"""Every hard case: the checks of its full-order run, and every reduction.

A reduction does not fail, or hard_cases.expected has its reason.
"""

from functools import cache
from itertools import cycle

import numpy as np
import pytest

from pdrom.core.yamlfile import read_yaml
from pdrom.model.effects import EFFECTS
from pdrom.reduction.method import load_methods
from places import CONFIG
from study.experiments.hard_cases import outcomes
from study.experiments.hard_cases.catalogue import CASES as CATALOGUE
from study.experiments.hard_cases.catalogue import reducible_cases
from study.experiments.hard_cases.record import faults

METHODS = load_methods(CONFIG / "methods.yaml")
EXPECTED = outcomes.HardCases(**read_yaml(CONFIG / "default.yaml")["hard_cases"]).expected
CASES = [*reducible_cases(), *reducible_cases(slow=True)]
REDUCTIONS = outcomes.names(METHODS)


@cache
def training(case: str) -> outcomes.Training:
    """The full-order run of a case, made once."""
    return outcomes.Training(CATALOGUE[case])


NAMES = [pytest.param(n, marks=[pytest.mark.slow] if c.slow else []) for n, c in CATALOGUE.items()]


@pytest.mark.parametrize("name", NAMES)
def test_the_checks_of_the_full_order_run_hold(name):
    case = CATALOGUE[name]
    assert case.holds == ("refused",) or {"finite", "objective"} <= set(case.holds)
    assert faults(case) == []


# The experiment `hard_cases` runs all pairs and `./reproduce verify` compares their table: only one
# reduction for each case, another one for the next case, is not slow.
PAIRS = [
    pytest.param(
        *(name, reduction),
        marks=[pytest.mark.slow] if CATALOGUE[name].slow or (i - j) % len(REDUCTIONS) else [],
    )
    for i, name in enumerate(CASES)
    for j, reduction in enumerate(REDUCTIONS)
]


@pytest.mark.parametrize(("name", "reduction"), PAIRS)
def test_outcome_is_as_expected(name, reduction):
    found = outcomes.row(training(name), reduction, METHODS, EXPECTED)
    assert outcomes.surprise(found["outcome"], name, EXPECTED.get(reduction)) == ""
    if found["outcome"] in outcomes.FAILURES:
        assert found["why"]
    else:
        assert found["frames"] in (0, training(name).scene.config.frames)


@pytest.mark.parametrize(
    ("name", "reduction"),
    list(zip(cycle(["scrambled_sheet", "bar_plane_rotation"]), REDUCTIONS, strict=False)),
)
def test_two_runs_give_the_same_bits(name, reduction):
    first, again = (
        outcomes.reduced_run(training(name), reduction, METHODS, 1e3).run for _ in range(2)
    )
    assert np.array_equal(first.positions, again.positions)


def taken(name: str) -> bool:
    """Whether a position subspace takes all effects of a case."""
    listed = [EFFECTS.load(effect["effect"]) for effect in CATALOGUE[name].effects]
    return all(effect.in_subspace for effect in listed)


# Each effect's first case that a subspace takes, and its first that it refuses.
FIRST = {
    (effect["effect"], taken(name)): name
    for name in reversed(list(reducible_cases()))
    for effect in CATALOGUE[name].effects
}


@pytest.mark.parametrize("name", sorted({*FIRST.values()}))
def test_a_subspace_takes_what_the_effects_say(name):
    """A subspace that refuses an effect names it; methods in vertex positions take all effects."""
    for reduction in ("pod-full", "pod"):
        found = outcomes.row(training(name), reduction, METHODS, EXPECTED)
        assert (found["outcome"] == outcomes.NOT_TAKEN) == (
            reduction == "pod-full" and not taken(name)
        )
        if found["outcome"] == outcomes.NOT_TAKEN:
            assert "effect '" in found["why"]


def test_expectations_name_reductions_that_exist():
    assert set(EXPECTED) <= set(REDUCTIONS)
    assert all(set(e.fails) | set(e.may_fail) <= set(CASES) for e in EXPECTED.values())
