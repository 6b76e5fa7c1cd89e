"""Selections equal those by a loop over the vertices; errors name key and value."""

import numpy as np
import pytest
from pydantic import TypeAdapter

from pdrom.core.errors import SceneError
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.selection import Selection, select_vertices
from pdrom.model.mesh.types import Mesh

SELECTION = TypeAdapter(Selection)
SHEET = cloth(6, 5, "xy")


def chosen(selection, mesh=SHEET):
    return select_vertices(mesh, SELECTION.validate_python(selection)).tolist()


def disc_with_holes():
    """A sheet of 9 x 9 without three of its inner vertices, two of them neighbours."""
    mesh = cloth(9, 9, "xz")
    gone = [20, 59, 60]
    kept = ~np.isin(mesh.triangles, gone).any(axis=1)
    left = np.setdiff1d(np.arange(81), gone)
    number = np.full(81, -1)
    number[left] = np.arange(len(left))
    return Mesh(mesh.points[left], number[mesh.triangles[kept]].astype(np.int32))


@pytest.mark.parametrize(
    ("selection", "holds"),
    [
        ({"kind": "box", "lower": [-0.23, 2.13, -1], "upper": [0.33, 2.41, 1]},
         lambda p: -0.23 <= p[0] <= 0.33 and 2.13 <= p[1] <= 2.41),
        ({"kind": "sphere", "centre": [0.1, 2.3, 0.0], "radius": 0.31},
         lambda p: np.linalg.norm(p - [0.1, 2.3, 0.0]) <= 0.31),
        ({"kind": "plane", "point": [0.0, 2.1, 0.0], "normal": [3.0, -4.0, 0.0]},
         lambda p: (p - [0.0, 2.1, 0.0]) @ [3.0, -4.0, 0.0] >= -1e-9),
    ],
    ids=["box", "sphere", "plane of any length of normal"],
)  # fmt: skip
def test_a_shape_selects_the_vertices_inside(selection, holds):
    expected = [v for v, point in enumerate(SHEET.points) if holds(point)]
    assert chosen(selection) == expected != []


@pytest.mark.parametrize("point", [0, 13, 29])
def test_the_nearest_vertices_of_a_point_are_selected(point):
    near = SHEET.points[point] + [0.01, -0.01, 3.0]
    assert chosen({"kind": "nearest", "point": near.tolist()}) == [point]
    five = chosen({"kind": "nearest", "point": near.tolist(), "count": 5})
    distance = np.linalg.norm(SHEET.points - near, axis=1)
    assert distance[five].max() <= np.delete(distance, five).min() + 1e-9
    # the first of equally near vertices
    square = cloth(3, 3, "xz")
    assert chosen({"kind": "nearest", "point": [0, 2, 0], "count": 2}, square) == [1, 4]


def test_boundary_loops_are_numbered_from_the_longest():
    mesh = disc_with_holes()
    loops = [chosen({"kind": "boundary_loop", "index": i}, mesh) for i in range(3)]
    rim = {v for side in ("left", "right", "back", "front") for v in chosen(side, mesh)}
    assert set(loops[0]) == rim
    # a hole of two vertices has a longer rim than a hole of one
    assert [len(loop) for loop in loops] == [32, 8, 6]
    with pytest.raises(SceneError, match="index = 3, the mesh has 3"):
        chosen({"kind": "boundary_loop", "index": 3}, mesh)
    with pytest.raises(SceneError, match="boundary loop: index = 0, the mesh has 0"):
        chosen({"kind": "boundary_loop"}, bar(3, 3, 3))


def test_components_are_numbered_from_the_largest():
    small, large = cloth(3, 3, "xz"), cloth(4, 4, "xz")
    points = np.concatenate([small.points, large.points + np.array([5.0, 0.0, 0.0])])
    mesh = Mesh(points, np.concatenate([small.triangles, large.triangles + 9]).astype(np.int32))
    assert chosen({"kind": "component"}, mesh) == list(range(9, 25))
    assert chosen({"kind": "component", "index": 1}, mesh) == list(range(9))


def test_combinations_of_selections_are_those_of_sets():
    left, top, ball = "left", [1, 2, 3, 7], {"kind": "sphere", "centre": [0, 2.5, 0], "radius": 0.4}
    sets = [set(chosen(part)) for part in (left, top, ball)]
    assert set(chosen({"kind": "union", "of": [left, top, ball]})) == set.union(*sets)
    both = {"kind": "intersection", "of": [top, {"kind": "complement", "of": ball}]}
    assert set(chosen(both)) == sets[1] - sets[2]
