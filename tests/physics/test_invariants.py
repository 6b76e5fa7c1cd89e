"""Properties that every correct projective-dynamics code has, for every constraint group."""

import numpy as np
import pytest

from builders import GRAVITY, GROUPS, make_scene, random_rotation, with_effects
from pdrom.model.dynamics.stepper import State
from pdrom.model.runs import trajectory


def test_rest_stays_at_rest_and_free_fall_is_a_rigid_parabola(group_scene):
    rest = group_scene.mesh.points
    assert np.abs(trajectory(group_scene)[-1] - rest).max() < 1e-9
    scene = with_effects(group_scene, GRAVITY)
    h, frames = scene.config.time_step, scene.config.frames
    fall = -9.81 * h**2 * np.arange(frames + 1) * np.arange(1, frames + 2) / 2
    expected = rest[None] + fall[:, None, None] * np.array([0.0, 1.0, 0.0])
    assert np.abs(trajectory(scene) - expected).max() < 1e-8


@pytest.mark.parametrize("group", ["spring", "strain", "deformation_gradient"])
def test_the_converged_step_conserves_angular_momentum(group, rng):
    """The converged implicit step conserves q x v with q at the end of the step.

    Internal forces are derivatives of a rotation-invariant energy, hence sum_v y_v x f_v = 0 at the
    fixed point of the local/global iteration.
    """
    scene = make_scene(
        {"effect": group, "weight": 1e3}, mesh=GROUPS[group], iterations=3000, frames=1
    )
    points = scene.mesh.points - scene.mesh.points.mean(axis=0)
    state = State(scene.mesh.points.copy(), np.cross([0.3, -0.2, 0.5], points))
    after, _ = scene.stepper().step(state, 0)
    masses = scene.masses[:, None]
    impulse = masses * (after.velocities - state.velocities)
    torque = np.cross(after.positions, impulse).sum(axis=0)
    assert np.abs(torque).max() < 1e-8 * np.linalg.norm(impulse) + 1e-9


@pytest.mark.parametrize("spread", [0.05, 1.0, 50.0])
def test_the_objective_never_rises_in_an_iteration(group_scene, rng, spread):
    """For fixed s each local/global iteration is a descent step, from any state."""
    scene = group_scene.changed(iterations=40, frames=3)
    loop = scene.stepper()
    shape = scene.mesh.points.shape
    state = State(
        scene.mesh.points + spread * rng.standard_normal(shape), rng.standard_normal(shape)
    )
    for frame in range(3):
        state, report = loop.step(state, frame)
        assert np.isfinite(state.positions).all()
        assert (np.diff(report.objective) <= 1e-12 * report.objective[0]).all()


def test_a_rotated_and_shifted_scene_has_the_rotated_and_shifted_run(group_scene, rng):
    scene = group_scene
    rotation, shift = random_rotation(rng), rng.standard_normal(3)
    points = scene.mesh.points + 0.02 * rng.standard_normal(scene.mesh.points.shape)
    velocities = rng.standard_normal(points.shape)
    loop = scene.stepper()
    moved, _ = loop.step(State(points, velocities), 0)
    other, _ = loop.step(State(points @ rotation.T + shift, velocities @ rotation.T), 0)
    expected = moved.positions @ rotation.T + shift
    assert np.abs(other.positions - expected).max() < 1e-9


@pytest.mark.parametrize("window", [0, 4])
def test_handles_reach_their_target(window):
    scene = make_scene(
        {"effect": "translate", "select": "top", "offset": [0.1, 0.2, -0.3], "over": 5},
        {"effect": "rotate", "select": "bottom", "axis": "y", "degrees": 90.0, "over": 8},
        {"effect": "spring", "weight": 1e5},
        frames=12, anderson_window=window,
    )  # fmt: skip
    points, final = scene.mesh.points, trajectory(scene)[-1]
    top = points[:, 1] > points[:, 1].max() - 1e-9
    bottom = points[:, 1] < points[:, 1].min() + 1e-9
    assert final[top] == pytest.approx(points[top] + [0.1, 0.2, -0.3], abs=1e-12)
    turned = points[bottom][:, [2, 1, 0]] * [1.0, 1.0, -1.0]
    assert final[bottom] == pytest.approx(turned, abs=1e-12)


def test_momentum_is_conserved_and_energy_does_not_grow_without_external_forces(group_scene, rng):
    """Implicit Euler is dissipative: kinetic plus constraint energy never exceeds its start.

    The projections are internal forces: they sum to zero, for every group. Bending is moved gently:
    its side rule takes the normal of each frame's beginning, so that its energy is a fixed function
    of the positions only as long as no vertex changes sides.
    """
    scene, masses = group_scene, group_scene.masses
    speed = 1e-3 if scene.config.groups == ["bending"] else 0.1
    velocities = speed * rng.standard_normal(scene.mesh.points.shape)
    loop = scene.stepper()
    state = State(scene.mesh.points.copy(), velocities)
    energies, still = [], 1e-9 * masses.sum()
    for frame in range(30):
        state, _ = loop.step(state, frame)
        assert masses @ state.velocities == pytest.approx(masses @ velocities, abs=still)
        rhs = np.zeros_like(state.positions)
        potential = sum(g.accumulate(state.positions, rhs) for g in loop.local_steps)
        kinetic = 0.5 * float(masses @ (state.velocities**2).sum(axis=1))
        energies.append(kinetic + potential)
    start = 0.5 * float(masses @ (velocities**2).sum(axis=1))
    assert max(energies) <= start * (1 + 1e-9)
