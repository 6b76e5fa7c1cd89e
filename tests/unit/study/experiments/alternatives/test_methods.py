"""All methods: same implicit step as projective dynamics, momentum, order, hard cases."""

import numpy as np
import pytest

from builders import GROUPS, from_python, make_scene
from pdrom.core.errors import ConfigurationError, SceneError
from pdrom.model.compiled.rows import as_vertices, flat
from pdrom.model.dynamics.frames import inertia_energy
from pdrom.model.dynamics.stepper import State
from study.experiments.alternatives.solvers.substeps import METHODS, alternative
from study.experiments.kit.converged import ConvergedStepper

SHEET = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}
HELD = ({"effect": "gravity"}, {"effect": "pins", "select": "left"})
CLOSED_FORM = ("spring", "strain", "tetrahedron_strain", "deformation_gradient")
# What minimises the objective of a frame, and iterations that suffice on these meshes.
IMPLICIT = {
    "projective": 3000,
    "anderson": 300,
    "chebyshev": 1500,
    "l-bfgs": 200,
    "newton": 40,
    "vertex-descent": 300,
}


def small(group: str, *effects: dict, weight: float = 1e5, **settings):
    mesh = SHEET if GROUPS[group]["kind"] == "cloth" else GROUPS[group]
    return make_scene(*effects, {"effect": group, "weight": weight}, mesh=mesh, **settings)


def crumpled(scene, rng, size: float = 0.02) -> State:
    return scene.initial_state(size * rng.standard_normal(scene.mesh.points.shape))


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("group", CLOSED_FORM)
def test_many_iterations_end_at_the_implicit_step(group, method, rng):
    scene = small(group, *HELD)
    start = crumpled(scene, rng)
    best = ConvergedStepper(scene, scene.system, 1e-12, 4000)
    expected, _ = best.step(start, 0)
    assert best.converged
    after, _ = alternative(method, scene, 1, IMPLICIT[method]).step(start, 0)
    np.testing.assert_allclose(after.positions, expected.positions, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(after.velocities, expected.velocities, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("group", CLOSED_FORM)
def test_compliant_constraints_come_near_the_implicit_step(group):
    """Their fixed point is the implicit step up to turns of the constraints within a frame."""
    scene = small(group, *HELD)
    loops = [ConvergedStepper(scene, scene.system, 1e-12, 4000), alternative("xpbd", scene, 1, 400)]
    states = [scene.initial_state()] * 2
    for frame in range(6):
        states = [loop.step(s, frame)[0] for loop, s in zip(loops, states, strict=True)]
    moved = np.linalg.norm(states[0].positions - scene.mesh.points)
    assert np.linalg.norm(states[1].positions - states[0].positions) < 0.02 * moved


def test_what_compliant_constraints_miss_vanishes_with_the_step():
    """The less a constraint turns within a step, the nearer is the implicit step."""
    misses = []
    for step in (0.016, 0.004, 0.001):
        scene = small("spring", *HELD, time_step=step)
        start = State(1.1 * scene.mesh.points, np.zeros_like(scene.mesh.points))
        best = ConvergedStepper(scene, scene.system, 1e-13, 4000)
        expected, _ = best.step(start, 0)
        after, _ = alternative("xpbd", scene, 1, 500).step(start, 0)
        moved = np.linalg.norm(expected.positions - start.positions)
        misses.append(np.linalg.norm(after.positions - expected.positions) / moved)
    assert misses[0] > 2.0 * misses[1] > 4.0 * misses[2]


@pytest.mark.parametrize("group", GROUPS)
def test_one_substep_is_the_step_loop(group, rng):
    scene = small(group, *HELD, iterations=4)
    start = crumpled(scene, rng)
    expected, _ = scene.stepper().step(start, 0)
    after, _ = alternative("projective", scene, 1, 4).step(start, 0)
    np.testing.assert_allclose(after.positions, expected.positions, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(after.velocities, expected.velocities, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("method", ["l-bfgs", "newton", "vertex-descent"])
def test_objective_falls_with_every_iteration(method, rng):
    scene = small("strain")
    start = crumpled(scene, rng, 0.1)
    system = scene.system
    s = as_vertices(start.positions)
    values = []
    for iterations in range(1, 12):
        after, _ = alternative(method, scene, 1, iterations).step(start, 0)
        energy = scene.groups[0].accumulate(after.positions, np.zeros_like(after.positions))
        y = flat(as_vertices(after.positions))
        values.append(energy + from_python(inertia_energy)(y, flat(s), system.inertia))
    assert (np.diff(values) <= 1e-12 * values[0]).all()
    assert values[-1] < 0.9 * values[0]


@pytest.mark.parametrize("method", sorted(set(METHODS) - {"vertex-descent"}))
@pytest.mark.parametrize("group", ["spring", "strain", "deformation_gradient"])
def test_a_free_body_gains_the_momentum_of_gravity_only(group, method, rng):
    scene = small(group, {"effect": "gravity"}, weight=1e4)
    start = crumpled(scene, rng)
    loop, state = alternative(method, scene, 4, 3), start
    for frame in range(3):
        state, _ = loop.step(state, frame)
    momentum = scene.masses @ (state.velocities - start.velocities)
    expected = scene.masses.sum() * 3 * scene.config.time_step * np.array([0.0, -9.81, 0.0])
    np.testing.assert_allclose(momentum, expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())


def test_explicit_steps_keep_angular_momentum_and_energy(rng):
    scene = small("spring", weight=1e4)
    start = crumpled(scene, rng)
    loop, state = alternative("explicit", scene, 20), start

    def angular(at):
        return scene.masses @ np.cross(at.positions, at.velocities)

    def energy(at):
        kinetic = 0.5 * scene.masses @ np.einsum("ij,ij->i", at.velocities, at.velocities)
        return kinetic + scene.groups[0].accumulate(at.positions, np.zeros_like(at.positions))

    spin = rng.standard_normal(3)
    state = State(start.positions, np.cross(spin, start.positions))
    first = angular(state), energy(state)
    for frame in range(40):
        state, _ = loop.step(state, frame)
    np.testing.assert_allclose(
        angular(state), first[0], rtol=0.0, atol=1e-9 * np.abs(first[0]).max()
    )
    assert energy(state) == pytest.approx(first[1], rel=1e-2)


def last(method, scene, substeps, iterations=1, frames=5):
    loop, state = alternative(method, scene, substeps, iterations), scene.initial_state()
    for frame in range(frames):
        state, _ = loop.step(state, frame)
    return state.positions


def test_explicit_steps_are_of_second_order():
    scene = small("spring", *HELD, weight=1e4)
    runs = [last("explicit", scene, n) for n in (20, 40, 80)]
    ratio = np.linalg.norm(runs[1] - runs[0]) / np.linalg.norm(runs[2] - runs[1])
    assert ratio == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("method", sorted(set(METHODS) - {"explicit"}))
def test_substeps_approach_the_motion_in_continuous_time(method):
    """Every method of first order ends at what fine explicit steps end at."""
    scene = small("spring", *HELD, weight=1e4)
    exact = last("explicit", scene, 400)
    errors = [np.linalg.norm(last(method, scene, n, 4) - exact) for n in (10, 40, 160)]
    assert errors[0] > 2.5 * errors[1] > 2.5**2 * errors[2]


@pytest.mark.parametrize("method", METHODS)
def test_two_runs_are_the_same_bit_for_bit(method, rng):
    scene = small("strain", *HELD)
    start = crumpled(scene, rng)
    first, second = (alternative(method, scene, 3, 3).step(start, 0)[0] for _ in range(2))
    assert first.positions.tobytes() == second.positions.tobytes()
    assert first.velocities.tobytes() == second.velocities.tobytes()


@pytest.mark.parametrize("method", METHODS)
def test_handles_and_floor_act_as_in_the_step_loop(method):
    handle = {"effect": "translate", "select": "left", "offset": [0.0, 0.3, 0.0], "over": 3}
    scene = small("spring", handle, {"effect": "gravity"}, {"effect": "floor", "height": 2.0})
    loop, state = alternative(method, scene, 8, 2), scene.initial_state()
    held = scene.boundaries[0].vertices
    for frame in range(3):
        state, _ = loop.step(state, frame)
        expected = scene.mesh.points[held] + [0.0, 0.1 * (frame + 1), 0.0]
        np.testing.assert_allclose(state.positions[held], expected, rtol=0.0, atol=1e-14)
        speed = 0.1 / scene.config.time_step
        np.testing.assert_allclose(state.velocities[held, 1], speed, rtol=1e-9)
    assert (state.positions[:, 1] >= 2.0).all()


HARD = {
    "spring": lambda q: np.zeros_like(q),  # every edge without a length
    "strain": lambda q: q * [1.0, 1.0, 0.0],  # every triangle a line
    "tetrahedron_strain": lambda q: q * [1.0, -1.0, 1.0],  # inverted
    "deformation_gradient": lambda q: q * [1.0, 0.0, 1.0],  # flat
}


@pytest.mark.parametrize("weight", [1e-2, 1e5, 1e12])
@pytest.mark.parametrize("method", sorted(set(METHODS) - {"explicit"}))
@pytest.mark.parametrize("group", HARD)
def test_degenerate_inverted_and_stiff_starts_stay_finite(group, method, weight):
    scene = small(group, *HELD, weight=weight)
    q = HARD[group](scene.mesh.points)
    after, _ = alternative(method, scene, 1, 5).step(State(q, np.zeros_like(q)), 0)
    assert np.isfinite(after.positions).all()
    assert np.ptp(after.positions, axis=0).max() < 10.0 * scene.mesh.extent


def test_what_a_method_does_not_take_is_refused_by_name():
    bending = small("bending")
    for method in ("xpbd", "newton", "vertex-descent"):
        with pytest.raises(SceneError, match=f"'bending': method '{method}' takes springs"):
            alternative(method, bending, 1)
    windy = small("spring", {"effect": "drag", "coefficient": 0.1})
    with pytest.raises(SceneError, match="'drag': method 'explicit' takes no force but gravity"):
        alternative("explicit", windy, 1)
    with pytest.raises(ConfigurationError, match=r"unknown method 'newtn'.*newton"):
        alternative("newtn", windy, 1)


def test_compiled_acceleration_is_that_of_the_step_loop(rng):
    scene = small("strain", *HELD, iterations=15, anderson_window=5)
    start = crumpled(scene, rng, 0.1)
    expected, _ = scene.stepper().step(start, 0)
    after, _ = alternative("anderson", scene, 1, 15).step(start, 0)
    np.testing.assert_allclose(after.positions, expected.positions, rtol=0.0, atol=1e-10)
