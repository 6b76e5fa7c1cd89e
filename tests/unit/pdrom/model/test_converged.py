"""The limit K -> infinity: L-BFGS against dense solves, SciPy's minimiser and very many steps."""

import numpy as np
import pytest
from scipy import optimize, sparse

from builders import GRAVITY, LEFT, make_scene
from pdrom.model.dynamics.acceleration import minimise
from pdrom.model.dynamics.stepper import Stepper
from pdrom.model.runs import ConvergedStepper

SHEET = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}


def sheet(group: str = "spring", **settings):
    effects = (GRAVITY, {"effect": "floor"}, LEFT, {"effect": group, "weight": 1e5})
    return make_scene(*effects, mesh=SHEET, **settings)


def test_a_quadratic_ends_at_its_minimum(rng):
    """Hessian H = A + B differs from the metric A, as with any nonlinear projection."""
    roots = rng.standard_normal((2, 8, 8))
    a, b = roots @ roots.transpose(0, 2, 1) + 8.0 * np.eye(8)
    hessian = a + b
    load = rng.standard_normal((8, 3))

    def evaluate(y):
        gradient = hessian @ y - load
        value = 0.5 * float(np.vdot(y, hessian @ y)) - float(np.vdot(y, load))
        return value, y - np.linalg.solve(a, gradient)

    end = minimise(evaluate, sparse.csr_array(a), np.zeros((8, 3)), 1e-10, 500)
    assert end.change <= 1e-10
    np.testing.assert_allclose(end.y, np.linalg.solve(hessian, load), rtol=0.0, atol=1e-8)


def test_a_metric_far_from_the_hessian_is_enough():
    """It need only bound the Hessian, as the system matrix does."""
    bound = 5000.0
    a = sparse.csr_array(bound * np.eye(2))

    def rosenbrock(y):
        value = float(optimize.rosen(y.ravel()))
        return value, y - optimize.rosen_der(y.ravel()).reshape(y.shape) / bound

    end = minimise(rosenbrock, a, np.full((2, 3), 0.6), 1e-10, 5000)
    assert end.change <= 1e-10
    np.testing.assert_allclose(end.y, 1.0, atol=1e-4)


def test_the_limit_ends_the_search_and_is_reported(rng):
    scene = sheet()
    loop = ConvergedStepper(scene, scene.system, 1e-14, 3)
    loop.step(scene.initial_state(), 0)
    assert loop.evaluations == [3]
    assert not loop.converged


@pytest.mark.parametrize("group", ["spring", "strain"])
def test_a_frame_ends_where_very_many_iterations_end(group, rng):
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
