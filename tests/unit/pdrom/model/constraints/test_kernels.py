"""Compiled kernels agree with the NumPy reference, and projections with their definition.

Kernels visit the elements of an unstructured mesh in an internal order.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from builders import GRAVITY, GROUPS, LEFT, call_kernel, make_scene
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.constraints.simplex import visiting_order
from pdrom.model.mesh.generators import cloth
from study.experiments.timing import IMPLEMENTATIONS

STATES = {
    "rest": lambda points, rng: points.copy(),
    "near rest": lambda points, rng: points + 1e-3 * rng.standard_normal(points.shape),
    "scrambled": lambda points, rng: rng.standard_normal(points.shape),
    "mirrored": lambda points, rng: points * [1.3, 0.9, -0.7],
    "flat": lambda points, rng: points * [1.0, 0.0, 1.0],
    "line": lambda points, rng: points * [1.0, 0.0, 0.0],
    "point": lambda points, rng: np.zeros_like(points),
    "huge": lambda points, rng: 1e120 * rng.standard_normal(points.shape),
    "tiny": lambda points, rng: 1e-120 * rng.standard_normal(points.shape),
}


@pytest.mark.parametrize("state", STATES)
def test_kernels_are_finite_deterministic_and_equal_the_numpy_reference(group_scene, rng, state):
    """At regular states p is unique: compiled and NumPy results agree up to rounding errors.

    A gradient kernel, called by its address, sees only S q and the parameters of some elements.
    """
    group = group_scene.groups[0].for_run()
    y = STATES[state](group_scene.mesh.points, rng)
    group.begin_frame(y)
    whole = group.project(y)
    assert np.isfinite(whole).all()
    assert np.array_equal(whole, group.project(y))
    if state not in ("rest", "near rest", "scrambled", "mirrored"):
        return
    d = (group.S @ y).reshape(group.elements, group.rows_per_element, 3)
    reference = group.reference_project(d, np.arange(group.elements)).reshape(-1, 3)
    # at rest, bending divides rounding errors by rounding errors only where the mesh is flat
    assert whole == pytest.approx(reference, rel=1e-10, abs=1e-10)
    elements = np.arange(0, group.elements, 3)
    expected = group.project_elements(y, elements).reshape(len(elements), -1, 3)
    assert np.array_equal(expected, whole.reshape(d.shape)[elements])
    if group.gradient_kernel is None:
        return
    some = np.ascontiguousarray(d[elements])
    p = np.full_like(some, np.nan)
    part, vertices = group.restricted(elements, np.ones(len(elements)))
    part.begin_frame(y[vertices])
    parameters = np.ascontiguousarray(part.kernel_parameters(), dtype=float)
    call_kernel(group.gradient_kernel.address, some, parameters, p, len(elements))
    np.testing.assert_allclose(p, expected, rtol=1e-10, atol=1e-12)
    assert group.frame_lagged == (type(group).begin_frame is not ConstraintGroup.begin_frame)


@pytest.mark.parametrize("implementation", IMPLEMENTATIONS)
def test_every_implementation_accumulates_the_same_force(group_scene, rng, implementation):
    group = group_scene.groups[0].for_run()
    y = group_scene.mesh.points + 0.05 * rng.standard_normal(group_scene.mesh.points.shape)
    group.begin_frame(y)
    compiled, other = np.zeros_like(y), np.zeros_like(y)
    energy = group.accumulate(y, compiled)
    other_energy = IMPLEMENTATIONS[implementation](group).accumulate(y, other)
    scale = np.abs(compiled).max()
    assert np.abs(compiled - other).max() < 1e-10 * scale
    assert energy == pytest.approx(other_energy, rel=1e-10)


@pytest.mark.parametrize("name", sorted(set(GROUPS) - {"bending"}))
def test_a_group_may_be_restricted_to_no_element(name):
    group = make_scene({"effect": name, "weight": 1.0}, mesh=GROUPS[name]).groups[0]
    none = np.empty(0, dtype=np.int64)
    part, vertices = group.restricted(none, np.empty(0))
    assert group.project_elements(np.zeros((50, 3)), none).shape == (0, 3)
    rhs = np.empty((len(vertices), 3))
    assert part.accumulate(rhs.copy(), rhs) == 0.0


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1))
def test_neighbours_of_a_shuffled_mesh_share_a_block(seed):
    mesh = cloth(20, 20)
    rng = np.random.default_rng(seed)
    cells = rng.permutation(400).astype(np.int32)[rng.permutation(mesh.triangles)]
    order = visiting_order(cells, 400)
    assert np.array_equal(np.sort(order), np.arange(len(cells)))
    shared = [len(np.unique(cells[order[k : k + 32]])) for k in range(0, len(cells), 32)]
    # 32 triangles of a grid, row by row, have 34 vertices
    assert np.mean(shared) < 40


@pytest.mark.parametrize("effect", ["strain", "tetrahedron_strain", "deformation_gradient"])
def test_results_of_a_group_are_in_the_element_order_of_the_mesh(effect):
    name = "disc.obj" if effect == "strain" else "torus.vtu"
    mesh = {"kind": "file", "path": f"config/scenes/meshes/{name}"}
    scene = make_scene({"effect": effect, "weight": 1e4}, mesh=mesh)
    group = scene.groups[0]
    order = visiting_order(group.stencil, scene.mesh.vertices)
    assert order is not None
    assert not np.array_equal(order, np.arange(group.elements))
    rng = np.random.default_rng(5)
    y = scene.mesh.points + 0.02 * rng.standard_normal(scene.mesh.points.shape)
    d = (group.S @ y).reshape(group.elements, group.rows_per_element, 3)
    every = np.arange(group.elements)
    expected = group.reference_project(d, every).reshape(-1, 3)
    assert group.project(y) == pytest.approx(expected, abs=1e-11)
    some = rng.permutation(every)[:70]
    p = group.sampler(some).projections(y, 70 * group.rows_per_element)
    rows = (group.rows_per_element * some[:, None] + np.arange(group.rows_per_element)).ravel()
    assert p == pytest.approx(expected[rows], abs=1e-11)
    rhs = np.zeros_like(y)
    energy = group.accumulate(y, rhs)
    weights = group.row_weights[:, None]
    assert rhs == pytest.approx(group.S.T @ (weights * expected), rel=1e-9, abs=1e-6)
    assert energy == pytest.approx(0.5 * np.sum(weights * (group.S @ y - expected) ** 2), rel=1e-9)


def test_compiled_iterations_add_all_groups():
    effects = [{"effect": name, "weight": 1e3} for name in ("bending", "spring", "strain")]
    scene = make_scene(GRAVITY, LEFT, *effects, mesh=GROUPS["bending"])
    compiled, plain = scene.stepper(), scene.stepper()
    assert compiled._compiled is not None
    plain._compiled = plain._whole = None
    state = other = scene.initial_state()
    for frame in range(5):
        state, other = compiled.step(state, frame)[0], plain.step(other, frame)[0]
    np.testing.assert_array_equal(state.positions, other.positions)
