"""Every hard case: the checks of its full-order run, and every reduction.

A reduction does not fail, or hard_cases.expected has its reason.
"""

from functools import cache
from itertools import cycle

import numpy as np
import pytest

from pdrom.core.errors import PdromError
from pdrom.core.yamlfile import read_yaml
from pdrom.model.effects import EFFECTS
from pdrom.model.metrics import shape_residuals
from pdrom.model.scene import Scene
from pdrom.reduction.method import load_methods
from places import CONFIG
from study.experiments.hard_cases import outcomes
from study.experiments.hard_cases.catalogue import CASES as CATALOGUE
from study.experiments.hard_cases.catalogue import reducible_cases
from study.experiments.hard_cases.record import (
    EPS,
    OPERATIONS,
    HardCase,
    Record,
    keeps_momentum,
    reach,
    record,
)

METHODS = load_methods(CONFIG / "methods.yaml")
EXPECTED = outcomes.HardCases(**read_yaml(CONFIG / "default.yaml")["hard_cases"]).expected
CASES = [*reducible_cases(), *reducible_cases(slow=True)]
REDUCTIONS = outcomes.names(METHODS)


@cache
def training(case: str) -> outcomes.Training:
    return outcomes.Training(CATALOGUE[case])


NAMES = [pytest.param(n, marks=[pytest.mark.slow] if c.slow else []) for n, c in CATALOGUE.items()]


def full_order(case: HardCase) -> tuple[Scene, Record]:
    scene = case.scene()
    return scene, record(scene, scene.stepper(), case.start(scene))


def energy_never_grows(case: HardCase, scene: Scene, run: Record) -> bool:
    """From rest it cannot: the first objective is the energy, and the implicit step damps."""
    energies = []
    for q, v in zip(run.positions, run.velocities, strict=True):
        groups = [group.for_run() for group in scene.groups]
        for group in groups:
            group.begin_frame(q)
        potential = sum(group.accumulate(q, np.zeros_like(q)) for group in groups)
        energies.append(0.5 * float(scene.masses @ (v**2).sum(axis=1)) + potential)
    elastic = float(np.abs(run.positions).max()) ** 2 * float(abs(scene.system.matrix).sum())
    return max(energies) <= energies[0] * (1.0 + 1e-9) + EPS * OPERATIONS * elastic


def ends_in_its_rest_shape(case: HardCase, scene: Scene, run: Record) -> bool:
    """Up to a rigid motion, nearer than 1 % of the longest side of the mesh."""
    residuals, scale = shape_residuals(scene.mesh.points[None], run.positions[-1:], scene.masses)
    return scale[0] * np.linalg.norm(residuals, axis=2).max() <= 1e-2 * scene.mesh.extent


def nothing_moves(case: HardCase, scene: Scene, run: Record) -> bool:
    start = run.positions[0]
    return np.abs(run.positions - start).max() <= 1e-9 * np.abs(start).max()


CHECKS = {
    "finite": lambda case, scene, run: len(run.positions) == scene.config.frames + 1,
    "bounded": lambda case, scene, run: run.extent <= case.bound * reach(scene, run.positions),
    "objective": lambda case, scene, run: run.excess.max() <= 0.0,
    "energy": energy_never_grows,
    "momentum": lambda case, scene, run: keeps_momentum(scene, run),
    "determinism": lambda case, scene, run: np.array_equal(
        run.positions, full_order(case)[1].positions
    ),
    "recovers": ends_in_its_rest_shape,
    "still": nothing_moves,
}


@pytest.mark.parametrize("name", NAMES)
def test_the_full_order_run_has_the_properties_that_the_catalogue_lists(name):
    case = CATALOGUE[name]
    if case.holds == ("refused",):
        with pytest.raises(PdromError):
            full_order(case)
        return
    assert {"finite", "objective"} <= set(case.holds)
    scene, run = full_order(case)
    assert [check for check in case.holds if not CHECKS[check](case, scene, run)] == []


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
    expected = EXPECTED.get(reduction, outcomes.Expectation(why="it never fails anywhere"))
    if found["outcome"] in outcomes.FAILURES:
        assert name in (*expected.fails, *expected.may_fail), found["outcome"]
    else:
        assert name not in expected.fails, found["outcome"]
        assert found["frames"] in (0, training(name).scene.config.frames)


@pytest.mark.parametrize(
    ("name", "reduction"),
    list(zip(cycle(["scrambled_sheet", "bar_plane_rotation"]), REDUCTIONS, strict=False)),
)
def test_two_runs_give_the_same_bits(name, reduction):
    model = outcomes.reduced_model(training(name), reduction, METHODS)
    first, again = (outcomes.reduced_run(training(name), model) for _ in range(2))
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
