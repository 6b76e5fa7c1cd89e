"""Elements of all groups in one list."""

from itertools import pairwise

import numpy as np
import pytest

from builders import GROUPS, from_python, make_scene
from pdrom.model.compiled.rows import as_vertices, flat
from study.experiments.alternatives.solvers.elements import Elements, decompose_element, workspace

KINDS = [name for name in GROUPS if name not in ("bending", "volume", "area")]


def elements_of(kind: str):
    scene = make_scene({"effect": kind, "weight": 1e3}, mesh=GROUPS[kind])
    return scene, Elements.of(scene, "xpbd")


@pytest.mark.parametrize("kind", KINDS)
def test_decompositions_are_those_of_the_group(kind, rng):
    scene, elements = elements_of(kind)
    (group,) = scene.groups
    q = scene.mesh.points + 0.1 * rng.standard_normal(scene.mesh.points.shape)
    y, p = flat(as_vertices(q)), group.rows_per_element
    expected = (group.S @ q).reshape(-1, p, 3)
    d, u, v, sigma = workspace()
    decompose = from_python(decompose_element)
    for e in range(0, len(elements.rows), 7):
        decompose(y, e, p, elements.corners, elements.operator, elements.fallback, d, u, v, sigma)
        found = (v[:p, :p] * sigma[:p]) @ u[:p]
        np.testing.assert_allclose(found, expected[e], atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("kind", KINDS)
def test_neighbours_in_the_list_share_no_vertex(kind):
    _, elements = elements_of(kind)
    coloured = elements.by_colour()
    corners = [set(c[: p + 1]) for c, p in zip(coloured.corners, coloured.rows, strict=True)]
    # where one colour ends and the next begins they may
    shared = sum(bool(a & b) for a, b in pairwise(corners))
    assert shared <= 0.3 * len(corners)
    assert sorted(map(sorted, corners)) == sorted(
        sorted(set(c[: p + 1])) for c, p in zip(elements.corners, elements.rows, strict=True)
    )


@pytest.mark.parametrize("kind", KINDS)
def test_every_corner_is_found_around_its_vertex(kind):
    scene, elements = elements_of(kind)
    starts, element, corner = elements.around(scene.mesh.vertices)
    for vertex in range(scene.mesh.vertices):
        own = slice(starts[vertex], starts[vertex + 1])
        assert (elements.corners[element[own], corner[own]] == vertex).all()
    assert starts[-1] == (elements.rows + 1).sum()
