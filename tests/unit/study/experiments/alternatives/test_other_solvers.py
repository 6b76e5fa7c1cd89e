"""Alternatives converge to the implicit step of projective dynamics; two levels save iterations."""

import numpy as np
import pytest

from builders import GRAVITY, GROUPS, LEFT, make_scene
from pdrom.model.dynamics.stepper import State
from pdrom.model.runs import ConvergedStepper, converged_run, followed
from pdrom.reduction.subspace.model import Samples, SubspaceModel
from pdrom.reduction.subspace.training import make_columns
from study.experiments.alternatives.solvers import Chebyshev, TwoLevel, measured_rate

SHEET = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}
HELD = (GRAVITY, LEFT)
CLOSED_FORM = ("spring", "strain", "tetrahedron_strain", "deformation_gradient")
CHEBYSHEV = 1500  # a sufficient number of iterations on these meshes


def small(group: str, *effects: dict, weight: float = 1e5, **settings):
    mesh = SHEET if GROUPS[group]["kind"] == "cloth" else GROUPS[group]
    return make_scene(*effects, {"effect": group, "weight": weight}, mesh=mesh, **settings)


def crumpled(scene, rng, size: float = 0.02) -> State:
    return scene.initial_state(size * rng.standard_normal(scene.mesh.points.shape))


def check_first_step(start, loop, reference, position=1e-8, velocity=1e-6):
    expected, _ = reference.step(start, 0)
    after, _ = loop.step(start, 0)
    np.testing.assert_allclose(after.positions, expected.positions, rtol=0.0, atol=position)
    np.testing.assert_allclose(after.velocities, expected.velocities, rtol=0.0, atol=velocity)


@pytest.mark.parametrize("group", CLOSED_FORM)
def test_many_iterations_end_at_the_implicit_step(group, rng):
    scene = small(group, *HELD)
    best = ConvergedStepper(scene, scene.system, 1e-12, 4000)
    check_first_step(crumpled(scene, rng), Chebyshev(scene, CHEBYSHEV), best)
    assert best.converged


@pytest.mark.parametrize("group", GROUPS)
def test_two_iterations_without_extrapolation_equal_the_step_loop(group, rng):
    scene = small(group, *HELD, iterations=2)
    loop = Chebyshev(scene, 2)
    loop.rate = 0.0
    check_first_step(crumpled(scene, rng), loop, scene.stepper(), 1e-12, 1e-10)


@pytest.mark.parametrize("weight", [1e3, 1e6])
def test_the_rate_is_the_convergence_rate_of_the_plain_iterations(weight):
    scene = small("spring", *HELD, weight=weight)
    best = ConvergedStepper(scene, scene.system, 1e-13, 4000)
    start = scene.initial_state()
    limit = best.step(start, 0)[0].positions
    ends = [scene.iterated(k).stepper().step(start, 0)[0].positions for k in (120, 121)]
    misses = [np.linalg.norm(end - limit) for end in ends]
    assert measured_rate(scene) == pytest.approx(misses[1] / misses[0], rel=0.02)


def test_handles_and_floor_act_as_in_the_step_loop():
    handle = {"effect": "translate", "select": "left", "offset": [0.0, 0.3, 0.0], "over": 3}
    scene = small("spring", handle, GRAVITY, {"effect": "floor", "height": 2.0})
    loop, state = Chebyshev(scene, 2), scene.initial_state()
    held = scene.boundaries[0].vertices
    for frame in range(3):
        state, _ = loop.step(state, frame)
        expected = scene.mesh.points[held] + [0.0, 0.1 * (frame + 1), 0.0]
        np.testing.assert_allclose(state.positions[held], expected, rtol=0.0, atol=1e-14)
        speed = 0.1 / scene.config.time_step
        np.testing.assert_allclose(state.velocities[held, 1], speed, rtol=1e-9)
    assert (state.positions[:, 1] >= 2.0).all()


def model_of(scene, modes: int, elements: np.ndarray | None = None) -> SubspaceModel:
    """Columns of the scene's converged run, and sampled elements with equal factors."""
    group = scene.groups[0]
    chosen = np.arange(group.elements) if elements is None else elements
    factors = np.full(len(chosen), group.elements / len(chosen))
    run = converged_run(scene, 1e-10, 4000)
    columns = make_columns([scene], run[1:], modes)
    return SubspaceModel(columns, {group.name: Samples(chosen, factors)})


@pytest.mark.parametrize("group", ["spring", "strain", "tetrahedron_strain"])
@pytest.mark.parametrize("every", [1, 7])
def test_many_iterations_end_at_the_implicit_step_for_any_sampled_elements(group, every, rng):
    scene = small(group, *HELD, frames=8)
    model = model_of(scene, 3, np.arange(0, scene.groups[0].elements, every))
    best = ConvergedStepper(scene, scene.system, 1e-12, 4000)
    check_first_step(crumpled(scene, rng), TwoLevel(scene, 400, model), best)


def test_the_coarse_level_saves_iterations():
    scene = small("spring", *HELD, frames=8)
    model = model_of(scene, 6)
    expected = converged_run(scene, 1e-10, 4000)[-1]
    misses = []
    for loop in (TwoLevel(scene, 4, model), scene.iterated(4, 5).stepper()):
        reached = followed(loop, scene.initial_state(), scene.config.frames)[-1]
        misses.append(np.linalg.norm(reached - expected))
    assert misses[0] < 0.5 * misses[1]
