"""Energy of a run against mechanics (free fall, stretched springs); errors and norms of tables."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import GRAVITY, TOP, make_scene, with_effects
from pdrom.model.energy import EnergyScale, energies, largest
from pdrom.model.metrics import relative_errors, trajectory_error
from pdrom.model.runs import trajectory
from strategies import SEEDS

SPRING = {"effect": "spring", "weight": 1e4}


def test_the_full_order_run_has_energy_ratio_one(group_scene):
    """For every group, for a maximum in the initial or a later state."""
    scene = with_effects(group_scene, GRAVITY)
    run = trajectory(scene)
    assert largest(EnergyScale.of(scene, run).relative(run)) == 1.0


def test_free_fall_turns_potential_into_kinetic_energy():
    """Rigid fall by implicit Euler: v_f = f h g and the drop is h^2 g f (f + 1) / 2."""
    scene = make_scene(SPRING, GRAVITY, frames=12)
    mass, h, g = scene.masses.sum(), scene.config.time_step, 9.81
    frames = np.array([0, 4, 8, 12])
    drop = g * h**2 * frames * (frames + 1) / 2
    expected = mass * (0.5 * (g * h * frames) ** 2 - g * drop)
    result = energies(scene, trajectory(scene))
    np.testing.assert_allclose(result - result[0], expected, rtol=1e-9, atol=1e-6)


def test_a_state_at_rest_has_the_energy_of_its_springs():
    """Uniform stretch by a factor: 1/2 w sum (factor - 1)^2 |edge|^2, no kinetic energy."""
    scene = make_scene(SPRING, frames=4)
    q = scene.mesh.points
    positions = np.stack([1.5 * q] * 5)
    edges = scene.mesh.edges()
    lengths = np.linalg.norm(q[edges[:, 1]] - q[edges[:, 0]], axis=1)
    expected = 0.5 * 1e4 * 0.25 * np.sum(lengths**2)
    np.testing.assert_allclose(energies(scene, positions), expected, rtol=1e-12)


def test_a_run_of_growing_energy_has_a_ratio_above_one_infinite_on_overflow():
    scene = make_scene(SPRING, GRAVITY, TOP, frames=12)
    run, rest = trajectory(scene), scene.mesh.points
    scale = EnergyScale.of(scene, run)
    blown = rest + 3.0 * (run - rest) + 0.5 * np.linspace(0, 1, 13)[:, None, None] * rest
    assert largest(scale.relative(blown)) > 2.0
    assert largest(scale.relative(run[:5])) <= 1.0
    assert largest(scale.relative(1e200 * run)) == np.inf
    # a scene at rest has nothing to compare with
    still = make_scene(SPRING, frames=12)
    assert largest(EnergyScale.of(still, np.stack([rest] * 13)).relative(run)) is None


@given(SEEDS, st.floats(1e-6, 1e6))
def test_relative_errors_agree_with_norms_of_matrices_and_have_no_unit(seed, unit):
    p, p_hat = np.random.default_rng(seed).standard_normal((2, 4, 5, 3))
    axes = [np.linalg.norm(p[..., a] - p_hat[..., a]) / np.linalg.norm(p[..., a]) for a in range(3)]
    expected = pytest.approx([np.linalg.norm(p - p_hat) / np.linalg.norm(p), *axes])
    assert relative_errors(p, p_hat, 0.0) == expected
    assert relative_errors(unit * p, unit * p_hat, unit * 1e-9) == expected


@pytest.mark.parametrize(
    ("size", "level", "expected"),
    [
        ([1.0, 1.0, 0.0], 1e-10, [0.1, 0.1, 0.1, None]),
        ([1.0, 1.0, 1e-12], 1e-10, [0.1, 0.1, 0.1, None]),
        # without a level the largest axis sets the scale
        ([1.0, 1.0, 1e-17], 0.0, [0.1, 0.1, 0.1, None]),
        (1e-14, 1e-20, [0.1] * 4),
        (1e-14, 1e-12, [None] * 4),
        (0.0, 0.0, [None] * 4),
    ],
)
def test_a_group_of_rounding_errors_has_no_relative_error(rng, size, level, expected):
    p = rng.standard_normal((6, 8, 3)) * size
    assert relative_errors(p, 0.9 * p, level) == pytest.approx(expected)


def test_the_trajectory_error_weighs_frames_by_their_displacement():
    assert trajectory_error(np.array([3.0, 4.0]), np.array([6.0, 8.0])) == 0.5
    assert trajectory_error(np.zeros(3), np.ones(3)) == 0.0
    # a run at rest has no error
    for frames in (0, 3):
        assert trajectory_error(np.ones(frames), np.zeros(frames)) is None
