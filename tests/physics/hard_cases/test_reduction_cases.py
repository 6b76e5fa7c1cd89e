"""Every reduction in every hard case: no failure, or hard_cases.expected has its reason."""

from itertools import cycle

import numpy as np
import pytest

from hard_cases import EXPECTED, METHODS, training
from pdrom.model.effects import EFFECTS
from study.experiments.hard_cases.catalogue import CASES as CATALOGUE
from study.experiments.hard_cases.catalogue import reducible_cases
from study.experiments.hard_cases.outcomes import (
    FAILURES,
    NOT_TAKEN,
    names,
    reduced_run,
    row,
    surprise,
)

CASES = [*reducible_cases(), *reducible_cases(slow=True)]
REDUCTIONS = names(METHODS)


def pairs() -> list:
    """Every case with every reduction.

    The experiment `hard_cases` runs all pairs and `./reproduce verify` compares their table.
    Therefore only one reduction for each case, another one for the next case, is not slow.
    """
    return [
        pytest.param(
            *(name, reduction),
            marks=[pytest.mark.slow] if CATALOGUE[name].slow or (i - j) % len(REDUCTIONS) else [],
        )
        for i, name in enumerate(CASES)
        for j, reduction in enumerate(REDUCTIONS)
    ]


@pytest.mark.parametrize(("name", "reduction"), pairs())
def test_outcome_is_as_expected(name, reduction):
    found = row(training(name), reduction, METHODS, EXPECTED)
    assert surprise(found["outcome"], name, EXPECTED.get(reduction)) == ""
    if found["outcome"] in FAILURES:
        assert found["why"]
    else:
        assert found["frames"] in (0, training(name).scene.config.frames)


@pytest.mark.parametrize(
    ("name", "reduction"),
    list(zip(cycle(["scrambled_sheet", "bar_plane_rotation"]), REDUCTIONS, strict=False)),
)
def test_two_runs_give_the_same_bits(name, reduction):
    first, again = (reduced_run(training(name), reduction, METHODS, 1e3).run for _ in range(2))
    assert np.array_equal(first.positions, again.positions)


def taken(name: str) -> bool:
    """Whether a position subspace takes all effects of a case."""
    listed = [EFFECTS.load(effect["effect"]) for effect in CATALOGUE[name].effects]
    return all(effect.in_subspace for effect in listed)


# Two thirds of the cases that a subspace takes are slow tests, since `pairs` runs them as well.
TAKEN = [name for name in reducible_cases() if taken(name)]
SELDOM = {name for i, name in enumerate(TAKEN) if i % 3}


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[pytest.mark.slow] if n in SELDOM else []) for n in reducible_cases()],
)
def test_a_subspace_takes_what_the_effects_say(name):
    """A subspace that refuses an effect names it; methods in vertex positions take all effects."""
    for reduction in ("pod-full", "pod"):
        found = row(training(name), reduction, METHODS, EXPECTED)
        assert (found["outcome"] == NOT_TAKEN) == (reduction == "pod-full" and not taken(name))
        if found["outcome"] == NOT_TAKEN:
            assert "effect '" in found["why"]


def test_expectations_name_reductions_that_exist():
    assert set(EXPECTED) <= set(REDUCTIONS)
    assert all(set(e.fails) | set(e.may_fail) <= set(CASES) for e in EXPECTED.values())
