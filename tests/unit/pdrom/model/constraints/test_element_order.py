"""Elements of an unstructured mesh are visited in an order of their own, which nobody sees."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from builders import make_scene
from pdrom.model.constraints.local_kernel import projections
from pdrom.model.constraints.simplex import visiting_order
from pdrom.model.mesh.generators import bar, cloth

SHAPES = {
    "strain": "disc.obj",
    "tetrahedron_strain": "torus.vtu",
    "deformation_gradient": "torus.vtu",
}


@pytest.mark.parametrize(
    ("cells", "vertices"),
    [(cloth(20, 20).triangles, 400), (bar(40, 5, 5).tetrahedra, 1000), (cloth(3, 3).triangles, 9)],
)
def test_grids_keep_their_order(cells, vertices):
    assert visiting_order(cells, vertices) is None


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_shuffled_mesh_gets_neighbours_into_blocks(seed):
    mesh = cloth(20, 20)
    rng = np.random.default_rng(seed)
    cells = rng.permutation(400).astype(np.int32)[rng.permutation(mesh.triangles)]
    order = visiting_order(cells, 400)
    assert np.array_equal(np.sort(order), np.arange(len(cells)))
    shared = [len(np.unique(cells[order[k : k + 32]])) for k in range(0, len(cells), 32)]
    # 32 triangles of a grid, row by row, have 34 vertices
    assert np.mean(shared) < 40


@pytest.mark.parametrize("effect", SHAPES)
def test_what_others_see_is_in_the_order_of_the_mesh(effect):
    mesh = {"kind": "file", "path": f"config/scenes/meshes/{SHAPES[effect]}"}
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
    p = projections(group.sampler(some), y, 70 * group.rows_per_element)
    rows = (group.rows_per_element * some[:, None] + np.arange(group.rows_per_element)).ravel()
    assert p == pytest.approx(expected[rows], abs=1e-11)
    rhs = np.zeros_like(y)
    energy = group.accumulate(y, rhs)
    weights = group.row_weights[:, None]
    assert rhs == pytest.approx(group.S.T @ (weights * expected), rel=1e-9, abs=1e-6)
    assert energy == pytest.approx(0.5 * np.sum(weights * (group.S @ y - expected) ** 2), rel=1e-9)
