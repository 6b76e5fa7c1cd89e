"""Energy of a run against mechanics: free fall, stretched springs, the full-order run itself."""

import numpy as np
import pytest

from builders import GRAVITY, TOP, make_scene, with_effects
from pdrom.model.energy import STRIDE, EnergyScale, energies
from pdrom.model.runs import trajectory

SPRING = {"effect": "spring", "weight": 1e4}


def test_the_full_order_run_has_ratio_one(group_scene):
    """Whatever the group, and whether or not the initial state or a later one has the most."""
    scene = with_effects(group_scene, GRAVITY)
    run = trajectory(scene)
    assert EnergyScale.of(scene, run).ratio(run) == 1.0


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


def test_the_last_frame_counts_whatever_the_stride():
    scene = make_scene(SPRING, frames=STRIDE + 1)
    positions = np.stack([scene.mesh.points] * (STRIDE + 2))
    positions[-1] *= 2.0
    assert len(energies(scene, positions)) == 3
    assert energies(scene, positions)[-1] > 1e3


def test_a_run_that_gains_energy_has_a_ratio_above_one_infinite_on_overflow():
    scene = make_scene(SPRING, GRAVITY, TOP, frames=12)
    run, rest = trajectory(scene), scene.mesh.points
    scale = EnergyScale.of(scene, run)
    blown = rest + 3.0 * (run - rest) + 0.5 * np.linspace(0, 1, 13)[:, None, None] * rest
    assert scale.ratio(blown) > 2.0
    assert scale.ratio(run[:5]) <= 1.0
    assert scale.ratio(1e200 * run) == np.inf
    # a scene at rest has nothing to compare with
    still = make_scene(SPRING, frames=12)
    assert EnergyScale.of(still, np.stack([rest] * 13)).ratio(run) is None


def test_the_zero_of_the_potential_does_not_matter():
    """The same fall two metres higher: the same ratios."""
    ratios = []
    for lift in ({}, {"lift": 7.0}):
        mesh = {"kind": "cloth", "rows": 6, "columns": 5, **lift}
        scene = make_scene(SPRING, GRAVITY, frames=8, mesh=mesh)
        run = trajectory(scene)
        ratios.append(EnergyScale.of(scene, run).ratio(run[:1].repeat(3, axis=0) + 0.01))
    assert ratios[0] == pytest.approx(ratios[1], rel=1e-9)
