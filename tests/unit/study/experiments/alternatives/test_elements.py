"""Elements of all groups in one list, and the distance of one to its clamped matrix."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from builders import GROUPS, from_python, make_scene
from pdrom.model.compiled.rows import as_vertices, flat
from study.experiments.alternatives.solvers import elements
from study.experiments.alternatives.solvers.elements import (
    MODES,
    Elements,
    decompose_element,
    workspace,
)

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


SIDES = st.floats(-3.0, 3.0, width=32)
X = (1.0, 0.0, 0.0)
decompose, residual, hessian = map(
    from_python, (elements.decompose, elements.residual, elements.hessian)
)


def parts(d):
    p = len(d)
    padded, u, v, sigma = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)
    padded[:p] = d
    decompose(padded, p, X, u, v, sigma)
    return u, v[:p, :p], v, sigma


def distance(d, low, high):
    """D - P by NumPy's decomposition; the smallest value of three rows carries the sign."""
    u, sigma, vt = np.linalg.svd(d, full_matrices=False)
    if len(d) == 3 and np.linalg.det(u) * np.linalg.det(vt) < 0.0:
        u[:, -1] *= -1.0
        sigma[-1] *= -1.0
    return d - (u * np.clip(sigma, low, high)) @ vt


def residual_of(d, low, high):
    u, _, v, sigma = parts(d)
    r = np.zeros((3, 3))
    square = residual(u, v, sigma, len(d), low, high, r)
    return r[: len(d)], square


def hessian_of(d, low, high, floor=0.0):
    p = len(d)
    u, _, v, sigma = parts(d)
    values, modes = np.zeros(MODES), np.zeros((MODES, 3, 3))
    count = hessian(u, v, sigma, p, low, high, floor, values, modes)
    rows = modes[:count, :p].reshape(count, 3 * p)
    np.testing.assert_allclose(rows @ rows.T, np.eye(count), atol=1e-12)
    return np.einsum("n,ni,nj->ij", values[:count], rows, rows)


@given(d=st.integers(1, 3).flatmap(lambda p: arrays(float, (p, 3), elements=SIDES)))
def test_factors_of_any_matrix(d):
    u, v, _, sigma = parts(d)
    p, scale = len(d), np.abs(d).max(initial=0.0)
    np.testing.assert_allclose(u @ u.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(u) == pytest.approx(1.0)
    np.testing.assert_allclose(v @ v.T, np.eye(p), atol=1e-12)
    np.testing.assert_allclose((v * sigma[:p]) @ u[:p], d, rtol=0.0, atol=1e-12 * scale)
    assert (np.diff(np.abs(sigma[:p])) <= 1e-12 * scale).all()


@pytest.mark.parametrize("p", [1, 2, 3])
def test_residual_is_that_of_the_nearest_point(p, rng):
    for d in rng.standard_normal((50, p, 3)):
        r, square = residual_of(d, 0.7, 1.2)
        np.testing.assert_allclose(r, distance(d, 0.7, 1.2), atol=1e-12)
        assert square == pytest.approx(np.sum(r * r), abs=1e-14)


@pytest.mark.parametrize("p", [1, 2, 3])
def test_hessian_is_the_positive_part_of_the_derivative(p, rng):
    """Against central differences, whose negative eigenvalues are set to zero."""
    step = 1e-6
    for d in 1.2 * rng.standard_normal((30, p, 3)):
        sigma = np.linalg.svd(d, compute_uv=False)
        gaps = [np.abs(np.subtract.outer(sigma, [0.7, 1.2])).min(), sigma.min()]
        if min(gaps) < 1e-3:
            continue  # a difference quotient across a kink says nothing
        columns = []
        for k in range(3 * p):
            shift = np.zeros(3 * p)
            shift[k] = step
            shift = shift.reshape(p, 3)
            change = distance(d + shift, 0.7, 1.2) - distance(d - shift, 0.7, 1.2)
            columns.append(change.ravel() / (2.0 * step))
        values, vectors = np.linalg.eigh(np.array(columns))
        expected = (vectors * np.maximum(values, 0.0)) @ vectors.T
        np.testing.assert_allclose(hessian_of(d, 0.7, 1.2), expected, atol=1e-6)
        np.testing.assert_allclose(hessian_of(d, 0.7, 1.2, 1.0), np.eye(3 * p), atol=1e-12)
