"""The coarse level: the same implicit step, in fewer iterations than without it."""

import numpy as np
import pytest

from builders import GROUPS, make_scene
from pdrom.core.errors import SceneError
from pdrom.reduction.subspace.model import Samples, SubspaceModel, make_columns
from study.experiments.alternatives.solvers.substeps import alternative
from study.experiments.alternatives.solvers.two_level import TwoLevel
from study.experiments.kit.converged import ConvergedStepper, converged_run

SHEET = {"kind": "cloth", "rows": 8, "columns": 7, "plane": "xz"}
HELD = ({"effect": "gravity"}, {"effect": "pins", "select": "left"})


def hanging(group: str):
    mesh = SHEET if GROUPS[group]["kind"] == "cloth" else GROUPS[group]
    return make_scene(*HELD, {"effect": group, "weight": 1e5}, mesh=mesh, frames=8)


def model_of(scene, modes: int, elements: np.ndarray | None = None) -> SubspaceModel:
    """Columns of the scene's own converged run; elements count for as many as are left out."""
    group = scene.groups[0]
    chosen = np.arange(group.elements) if elements is None else elements
    factors = np.full(len(chosen), group.elements / len(chosen))
    run = converged_run(scene, 1e-10, 4000)
    columns = make_columns(scene, run[1:], "pod", k=modes)
    return SubspaceModel("pod", columns, {group.name: Samples(chosen, factors)})


@pytest.mark.parametrize("group", ["spring", "strain", "tetrahedron_strain"])
@pytest.mark.parametrize("every", [1, 7])
def test_whatever_is_sampled_many_iterations_end_at_the_implicit_step(group, every, rng):
    scene = hanging(group)
    start = scene.initial_state(0.02 * rng.standard_normal(scene.mesh.points.shape))
    model = model_of(scene, 3, np.arange(0, scene.groups[0].elements, every))
    best = ConvergedStepper(scene, scene.system, 1e-12, 4000)
    expected, _ = best.step(start, 0)
    after, _ = TwoLevel(scene, 1, 400, model).step(start, 0)
    np.testing.assert_allclose(after.positions, expected.positions, rtol=0.0, atol=1e-8)


def test_few_iterations_do_what_takes_many_without_the_coarse_level():
    scene = hanging("spring")
    model = model_of(scene, 6)
    expected = converged_run(scene, 1e-10, 4000)[-1]
    misses = []
    for loop in (TwoLevel(scene, 1, 4, model), alternative("anderson", scene, 1, 4)):
        state = scene.initial_state()
        for frame in range(scene.config.frames):
            state, _ = loop.step(state, frame)
        misses.append(np.linalg.norm(state.positions - expected))
    assert misses[0] < 0.5 * misses[1]


def objective(scene, state, y: np.ndarray) -> float:
    """1/(2h^2) |M^1/2 (y - s)|^2 + W(y), J, of the frame that begins at ``state``."""
    h = scene.config.time_step
    s = state.positions + h * state.velocities + h**2 * np.array([0.0, -9.81, 0.0])
    s[scene.mesh.points[:, 0] == scene.mesh.points[:, 0].min()] = 0.0
    y = y.copy()
    moved = np.where(s == 0.0, 0.0, y - s)
    inertia = 0.5 * float(np.sum(scene.masses[:, None] * moved**2)) / h**2
    return inertia + scene.groups[0].accumulate(y, np.zeros_like(y))


@pytest.mark.parametrize("iterations", [2, 3, 5, 9])
def test_a_subspace_of_noise_never_raises_the_objective(iterations, rng):
    """Its corrections lead astray from the first image on: the frame does without them."""
    scene = hanging("spring")
    shape = scene.mesh.points.shape
    noise = scene.mesh.points + 0.3 * rng.standard_normal((4, *shape))
    chosen = np.arange(0, scene.groups[0].elements, 9)
    samples = {"spring": Samples(chosen, np.full(len(chosen), 0.01))}
    model = SubspaceModel("pod", make_columns(scene, noise, "pod", k=4), samples)
    state = scene.initial_state(0.1 * rng.standard_normal(shape))
    once = alternative("projective", scene, 1, 1).step(state, 0)[0]
    after = TwoLevel(scene, 1, iterations, model).step(state, 0)[0]
    assert objective(scene, state, after.positions) <= objective(scene, state, once.positions)


def test_several_groups_are_refused():
    scene = hanging("spring")
    both = make_scene(
        *HELD, {"effect": "spring", "weight": 1e5}, {"effect": "strain", "weight": 1e5}, mesh=SHEET
    )
    with pytest.raises(SceneError, match="'two-level' takes one group"):
        TwoLevel(both, 1, 1, model_of(scene, 2))
