"""Anderson acceleration; reference: its equivalence with GMRES on affine maps (Walker, Ni 2011)."""

import numpy as np
import pytest

from builders import GRAVITY, GROUPS, LEFT, make_scene
from pdrom.model.dynamics.acceleration import Anderson
from pdrom.model.runs import simulate, trajectory


def test_residual_is_that_of_gmres(rng):
    """With an unlimited window step m + 1 is the image of the m-th iterate of GMRES (here by dense
    least squares over the Krylov space), of a symmetric contraction."""
    q, _ = np.linalg.qr(rng.standard_normal((12, 12)))
    matrix = q * np.linspace(0.3, 0.95, 12) @ q.T
    shift = np.repeat(rng.standard_normal((12, 1)), 3, axis=1)
    steps, operator = 5, np.eye(12) - matrix
    powers = [np.linalg.matrix_power(operator, i) @ shift[:, 0] for i in range(steps)]
    krylov, _ = np.linalg.qr(np.stack(powers, axis=1))
    found = krylov @ np.linalg.lstsq(operator @ krylov, shift[:, 0], rcond=None)[0]
    acceleration, y = Anderson(20), np.zeros_like(shift)
    acceleration.begin_frame(y)
    for _ in range(steps + 1):
        assert not acceleration.refuse(y, float("nan"))
        y = matrix @ y + shift
        acceleration.combine(y)
    assert np.allclose(y[:, 0], matrix @ found + shift[:, 0], atol=1e-7 * np.abs(y).max())


@pytest.mark.parametrize("group", sorted(GROUPS))
def test_same_fixed_point_and_monotone_objective(group):
    effects = ({"effect": group, "weight": 1e4}, GRAVITY)
    settings = {"mesh": GROUPS[group], "frames": 3}
    plain = trajectory(make_scene(*effects, **settings, iterations=2000))
    for window in (1, 3, 6):
        fast = make_scene(*effects, **settings, iterations=300, anderson_window=window)
        assert np.abs(trajectory(fast) - plain).max() < 1e-7
        for _, report in simulate(fast):
            rises = np.diff(report.objective) / np.maximum(np.abs(report.objective[:-1]), 1e-12)
            assert rises.max() < 1e-9


@pytest.mark.parametrize("group", ["spring", "strain", "deformation_gradient"])
def test_ten_accelerated_iterations_beat_ten_plain_ones(group):
    effects = ({"effect": group, "weight": 1e5}, GRAVITY, LEFT)
    runs = {
        (k, w): trajectory(
            make_scene(*effects, mesh=GROUPS[group], frames=8, iterations=k, anderson_window=w)
        )[-1]
        for k, w in ((10, 0), (10, 5), (1500, 0))
    }
    plain, fast = (np.linalg.norm(runs[10, w] - runs[1500, 0]) for w in (0, 5))
    assert fast < 0.5 * plain


def test_a_risen_objective_brings_back_the_plain_image():
    acceleration, y = Anderson(3), np.ones((2, 3))
    acceleration.begin_frame(y)
    for objective in (2.0, 1.0):
        assert not acceleration.refuse(y, objective)
        y = 0.5 * y
        plain = y.copy()
        acceleration.combine(y)
    y += 5.0
    assert acceleration.refuse(y, 3.0)
    assert np.array_equal(y, plain)
