"""Energy-conserving sampling and weighting: few elements that stand for all, and stability."""

from copy import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import GROUPS, make_scene
from pdrom.fom.run import trajectory
from pdrom.fom.stepper import State, Stepper
from pdrom.subspace.columns import build_columns
from pdrom.subspace.ecsw import ecsw_elements, training_rows
from pdrom.subspace.local_step import SubspaceLocalStep
from pdrom.subspace.model import SubspaceModel, make_columns, sample_elements
from pdrom.subspace.space import ReducedSpace, coordinates

SCENES = {
    name: make_scene({"effect": name, "weight": 1e4}, {"effect": "gravity"}, mesh=GROUPS[name])
    for name in GROUPS
}


def random_columns(scene, rng, k=5):
    modes = rng.standard_normal((scene.mesh.vertices, k))
    none = np.stack([scene.mesh.points] * 2)
    return build_columns(modes, scene.mesh.points, scene.masses, [], none)


@pytest.mark.parametrize("name", SCENES)
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**31), spread=st.floats(-2, 1.5))
def test_objective_never_rises_whatever_the_factors(name, seed, spread):
    """Random elements, random non-negative factors, random states."""
    scene, rng = SCENES[name], np.random.default_rng(seed)
    columns = random_columns(scene, rng)
    group = scene.groups[0]
    elements = np.sort(rng.permutation(group.elements)[: rng.integers(1, group.elements)])
    factors = 10.0 ** rng.uniform(-3, 3, len(elements))
    factors[rng.random(len(elements)) < 0.2] = 0.0
    factors[0] = 1.0
    step = SubspaceLocalStep(group, columns, elements, factors)
    loop = Stepper(ReducedSpace(scene, columns, step.matrix), 0.016, 20, [step])
    shape = scene.mesh.points.shape
    q = scene.mesh.points + 10.0**spread * rng.standard_normal(shape)
    state = State(
        coordinates(columns, scene.masses, q),
        coordinates(columns, scene.masses, rng.standard_normal(shape)),
    )
    for frame in range(2):
        state, report = loop.step(state, frame)
        assert np.isfinite(state.positions).all()
        assert (np.diff(report.objective) <= 1e-11 * report.objective[0]).all()


@pytest.fixture(scope="module")
def pulled():
    """Scene of springs and strain under a handle, its run, and a snapshot basis."""
    scene = make_scene(
        {"effect": "spring", "weight": 1e4},
        {"effect": "strain", "weight": 1e5},
        {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]},
        {"effect": "pins", "select": "top"},
        mesh={"kind": "cloth", "rows": 10, "columns": 9},
        frames=12,
    )
    run = trajectory(scene)
    return scene, run, make_columns(scene, run[1:], "pod", 4)


def in_space(scene, columns, states) -> np.ndarray:
    return np.stack([columns.B @ coordinates(columns, scene.masses, q) for q in states])


@pytest.mark.parametrize("tolerance", [0.3, 1e-2, 1e-3])
def test_sampled_equations_meet_the_tolerance(pulled, tolerance):
    scene, run, columns = pulled
    states = in_space(scene, columns, run[1::3])
    for group in scene.groups:
        elements, factors = ecsw_elements(group, columns, states, tolerance)
        assert (factors > 0.0).all()
        assert len(np.unique(elements)) == len(elements) < group.elements
        rows = training_rows(group, columns, states)
        left = rows[:, elements] @ factors - rows.sum(axis=1)
        assert np.linalg.norm(left) <= tolerance * np.linalg.norm(rows.sum(axis=1)) * (1 + 1e-9)


def test_a_finer_tolerance_gives_a_better_run(pulled):
    scene, run, columns = pulled
    motion = np.linalg.norm(run - run[0])

    def error(samples) -> float:
        model = SubspaceModel("pod", columns, samples)
        loop, state = model.loop(scene)
        off = 0.0
        for frame in range(scene.config.frames):
            state, _ = loop.step(state, frame)
            off += np.linalg.norm(model.positions(state.positions) - run[frame + 1]) ** 2
        return np.sqrt(off) / motion

    full = error({})
    fine = error(sample_elements(scene, columns, run[1:], 1e-3))
    coarse = error(sample_elements(scene, columns, run[1:], 0.5))
    assert full < 0.05
    assert abs(fine - full) < 0.05
    assert coarse > fine


def test_training_equations_are_the_elements_forces_and_stiffness(rng):
    """Element by element from the definition; hashing adds each equation to one row, signed."""
    scene = SCENES["strain"]
    group, columns = copy(scene.groups[0]), random_columns(scene, rng, 3)
    group.weights = group.weights * rng.uniform(0.2, 5.0, group.elements)
    states = rng.standard_normal((1, *scene.mesh.points.shape))
    y, p, k = states[0], group.rows_per_element, columns.B.shape[1]
    group.begin_frame(y)
    force, stiffness = np.zeros((2, 3 * k, group.elements))
    projected, dense = group.project(y), group.S.toarray()
    for e in range(group.elements):
        own = slice(p * e, p * (e + 1))
        left = group.weights[e] * columns.B.T @ dense[own].T
        force[:, e] = (left @ (dense[own] @ y - projected[own])).T.ravel()
        stiffness[:, e] = (left @ (dense[own] @ y)).T.ravel()
    force /= np.linalg.norm(force.sum(axis=1))
    stiffness /= np.linalg.norm(stiffness.sum(axis=1))
    rows = training_rows(group, columns, states)
    assert rows.shape == (2 * 3 * k + 1, group.elements)
    np.testing.assert_allclose(rows[-1], group.weights / group.weights.sum(), rtol=1e-14)
    # the equations of the constant column are empty, those of the others are independent
    real = np.linalg.norm(stiffness, axis=1) > 1e-10
    assert np.linalg.matrix_rank(stiffness[real]) == real.sum() < group.elements
    hashing = rows[3 * k : -1] @ np.linalg.pinv(stiffness[real])
    np.testing.assert_allclose(np.sort(abs(hashing), axis=0)[-1], 1.0, atol=1e-6)
    np.testing.assert_allclose(np.sort(abs(hashing), axis=0)[:-1], 0.0, atol=1e-6)
    assert {-1.0, 1.0} <= set(hashing.round().ravel().tolist())
    np.testing.assert_allclose(rows[: 3 * k], hashing.round() @ force[real], atol=1e-9)


def test_a_group_at_rest_keeps_its_stiffness(pulled):
    """No force at all in the training states, and still elements and weight."""
    scene, _, columns = pulled
    for group in scene.groups:
        elements, factors = ecsw_elements(group, columns, scene.mesh.points[None], 1e-2)
        assert len(elements) > 0
        kept = factors @ group.weights[elements] / group.weights.sum()
        assert kept == pytest.approx(1.0, abs=0.2)


def test_the_choice_is_repeatable(pulled):
    scene, run, columns = pulled
    states = in_space(scene, columns, run[1:4])
    one, two = (ecsw_elements(scene.groups[0], columns, states, 1e-2) for _ in range(2))
    np.testing.assert_array_equal(one[0], two[0])
    np.testing.assert_array_equal(one[1], two[1])
    assert len(ecsw_elements(scene.groups[0], columns, states, 0.0, most=5)[0]) == 5
