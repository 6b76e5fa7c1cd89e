"""Converged frames (K -> infinity): L-BFGS against very many iterations."""

from dataclasses import replace

import numpy as np
import pytest

from builders import GRAVITY, LEFT, make_scene
from pdrom.model.dynamics.stepper import Stepper
from pdrom.model.runs import ConvergedStepper

SHEET = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}


def sheet(group: str = "spring", **settings):
    effects = (GRAVITY, {"effect": "floor"}, LEFT, {"effect": group, "weight": 1e5})
    return make_scene(*effects, mesh=SHEET, **settings)


def test_the_limit_of_evaluations_ends_the_minimisation_and_is_reported(rng):
    scene = sheet()
    loop = ConvergedStepper(scene, scene.system, 1e-14, 3)
    loop.step(scene.initial_state(), 0)
    assert loop.evaluations == [3]
    assert not loop.converged


@pytest.mark.parametrize("group", ["spring", "strain"])
def test_a_converged_frame_equals_very_many_iterations(group, rng):
    scene = sheet(group)
    state = scene.initial_state(0.02 * rng.standard_normal(scene.mesh.points.shape))
    best = ConvergedStepper(scene, scene.system, 1e-11, 2000)
    other, begun = ConvergedStepper(scene, scene.system, 1e-11, 2000, from_last=True), state
    config = scene.config
    plain = Stepper(scene.space(scene.system), config.time_step, 10_000, scene.groups)
    for frame in range(3):
        expected, report = plain.step(state, frame)
        state, _ = best.step(state, frame)
        # the plain iteration has converged
        assert report.objective[-2] - report.objective[-1] <= 1e-10 * report.objective[-1]
        np.testing.assert_allclose(state.positions, expected.positions, rtol=0.0, atol=2e-7)
        state = expected
        again, _ = other.step(begun, frame)
        np.testing.assert_allclose(again.positions, expected.positions, rtol=0.0, atol=2e-7)
        begun = expected
    assert best.converged
    assert max(best.evaluations) < 500
    assert best.evaluations != other.evaluations  # their frames start from different positions


class WithoutKernel:
    """A group whose local step is Python code."""

    def __init__(self, group) -> None:
        self.name, self._group = group.name, group

    def begin_frame(self, q: np.ndarray) -> None:
        """Freeze nothing."""

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        return self._group.accumulate(y, rhs)


def test_a_group_without_compiled_code_converges_to_the_same_frame(rng):
    scene = sheet("strain")
    python = replace(scene, groups=[WithoutKernel(group) for group in scene.groups])
    loops = [ConvergedStepper(each, scene.system, 1e-9, 500) for each in (scene, python)]
    state = scene.initial_state(0.02 * rng.standard_normal(scene.mesh.points.shape))
    compiled, plain = (loop.step(state, 0)[0].positions for loop in loops)
    np.testing.assert_array_equal(compiled, plain)
    assert loops[0].evaluations == loops[1].evaluations != [1]
