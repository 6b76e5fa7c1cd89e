"""Every kind of degenerate element: the compiled projections against LAPACK's singular values.

Elements with the unit simplex as rest shape have S q = F^T exactly, so that F itself is chosen.
"""

from copy import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import call_kernel, random_rotation
from pdrom.model.constraints.bending import VertexBending
from pdrom.model.constraints.lanes import LANES, pack
from pdrom.model.constraints.spring import EdgeSpring
from pdrom.model.constraints.tetrahedron import DeformationGradient, TetrahedronStrain
from pdrom.model.constraints.triangle_strain import TriangleStrain
from pdrom.model.constraints.volume import TetrahedronVolume, TriangleArea
from pdrom.model.mesh.generators import cloth
from pdrom.model.mesh.types import Mesh
from simplices import bound, projected

KINDS = {
    "rotation": (DeformationGradient, 3, {}),
    "narrow": (TetrahedronStrain, 3, {"minimum": 0.99, "maximum": 1.01}),
    "wide": (TetrahedronStrain, 3, {"minimum": 0.1, "maximum": 10.0}),
    "triangle": (TriangleStrain, 2, {"minimum": 0.99, "maximum": 1.01}),
    "wide triangle": (TriangleStrain, 2, {"minimum": 0.1, "maximum": 10.0}),
}
SIZES = {"volume": (TetrahedronVolume, 3, {}), "area": (TriangleArea, 2, {})}

# zero, round-off, tiny, small, repeated, in range, and any size
SINGULAR_VALUES = st.one_of(
    st.sampled_from([0.0, 1e-300, 1e-17, 1e-16, 1e-12, 1e-8, 1e-5, 0.1, 0.99, 1.0, 1.01, 2.0]),
    st.floats(0.0, 5.0),
    st.floats(-1e-7, 1e-7).map(lambda x: 1.0 + x),
)


# products of two and of three entries leave the range of numbers within this one
EXPONENTS = st.floats(-300.0, 300.0)


@st.composite
def matrices(draw, rows: int) -> np.ndarray:
    """F^T of one element from its singular values, maybe mirrored, at any scale."""
    sigma = np.array([draw(SINGULAR_VALUES) for _ in range(rows)])
    if draw(st.booleans()):
        sigma[-1] = -sigma[-1]
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    left, right = random_rotation(rng)[:rows], random_rotation(rng)[:rows, :rows]
    turn = draw(st.sampled_from(["random", "none", "by pi", "diagonal"]))
    if turn == "none":
        left, right = np.eye(rows, 3), np.eye(rows)
    elif turn == "by pi":
        left, right = np.diag([-1.0, -1.0, 1.0])[:rows], np.eye(rows)
    elif turn == "diagonal":
        left, right = random_rotation(rng)[:rows], np.eye(rows)
    scale = 10.0 ** draw(st.one_of(st.just(0.0), EXPONENTS))
    return scale * (right.T @ (sigma[:, None] * left))


def gap(f: np.ndarray) -> float:
    """How far F is from matrices without a unique projection, relative to its norm."""
    sigma = np.linalg.svd(f, compute_uv=False)
    if sigma[0] == 0.0:
        return 0.0
    smallest = sigma[-1]
    if len(f) == 3 and np.linalg.det(f / sigma[0]) < 0.0:
        smallest = -smallest
    # two columns in space may turn about each other only where the smaller one vanishes
    return (sigma[-2] + smallest if len(f) == 3 else sigma[-1]) / sigma[0]


@pytest.mark.parametrize("kind", KINDS)
@given(data=st.data())
def test_the_projection_is_the_nearest_member(kind, data):
    """In the manifold, as near as LAPACK's; equal to it to 1e-10 where it is unique."""
    group_type, rows, settings = KINDS[kind]
    f = data.draw(matrices(rows))[None]
    group = bound(group_type, rows, 1, **settings)
    p, reference = projected(group, f), group.reference_project(f, np.arange(1))
    low, high = settings.get("minimum", 1.0), settings.get("maximum", 1.0)
    sigma = np.linalg.svd(p[0], compute_uv=False)
    assert low * (1 - 1e-13) <= sigma[-1] <= sigma[0] <= high * (1 + 1e-13)
    if rows == 3:
        assert np.linalg.det(p[0]) > 0.0
    scale = max(np.abs(f).max(), 1.0)
    norm = np.linalg.norm(f / scale) + np.linalg.norm(reference / scale)
    nearest = np.linalg.norm((f - reference) / scale)
    assert np.linalg.norm((f - p) / scale) <= nearest + 1e-13 * norm
    # a value that is round-off of the largest one may lie anywhere beside the range
    sigma = np.linalg.svd(f[0], compute_uv=False)
    ends = (np.clip(sigma + shift * 1e-14 * sigma[0], low, high) for shift in (1.0, -1.0))
    if gap(f[0]) > 1e-4 and np.ptp(list(ends), axis=0).max() <= 1e-11 * high:
        assert np.abs(p - reference).max() <= 1e-10 * np.abs(reference).max()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("kind", [*KINDS, *SIZES])
def test_what_is_not_finite_stays_so_and_harms_no_other(kind, bad, rng):
    group_type, rows, settings = (KINDS | SIZES)[kind]
    f = rng.standard_normal((3 * LANES, rows, 3))
    group = bound(group_type, rows, len(f), **settings)
    clean = projected(group, f)
    f[LANES + 1, 0, 1] = bad
    p = projected(group, f)
    others = np.arange(len(f)) != LANES + 1
    assert np.isnan(p[LANES + 1]).any()
    assert np.array_equal(p[others], clean[others])


@pytest.mark.parametrize("kind", [*KINDS, *SIZES])
def test_an_element_has_the_same_bits_in_any_company(kind, rng):
    """Neighbours in a block take part in the same loops, but change nothing."""
    group_type, rows, settings = (KINDS | SIZES)[kind]
    f = np.eye(3)[:rows] + rng.standard_normal((2 * LANES + 3, rows, 3)) * 10.0 ** rng.uniform(
        -9, 1, (2 * LANES + 3, 1, 1)
    )
    together = projected(bound(group_type, rows, len(f), **settings), f)
    alone = bound(group_type, rows, 1, **settings)
    for i in range(len(f)):
        assert np.array_equal(projected(alone, f[i : i + 1])[0], together[i])


def _one_spring() -> EdgeSpring:
    mesh = Mesh(
        np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 4.0], [1.0, 0.0, 0.0]]), np.array([[0, 1, 2]])
    )
    return EdgeSpring(EdgeSpring.Config(weight=1.0), mesh, np.ones(3))


def test_a_spring_without_length_takes_its_rest_edge():
    group = _one_spring()
    p = group.project(np.ones((3, 3)))
    assert np.array_equal(p, group.rest)
    tiny = np.array([[0.0, 0.0, 0.0], [5e-324, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert group.project(tiny)[0] == pytest.approx([5.0, 0.0, 0.0], rel=1e-12)


@given(exponent=EXPONENTS, seed=st.integers(0, 2**32 - 1))
def test_bending_at_any_scale(exponent, seed):
    """The half sphere is scale-free: p keeps the rest magnitude, and the reference is met."""
    rng = np.random.default_rng(seed)
    y = 10.0**exponent * rng.standard_normal((42, 3))
    _CURVED.begin_frame(y)
    d = (_CURVED.S @ y)[:, None, :]
    p, reference = _CURVED.project(y), _CURVED.reference_project(d, np.arange(_CURVED.elements))
    assert np.linalg.norm(_CURVED.normals, axis=1) == pytest.approx(1.0, rel=1e-12)
    assert np.abs(p - reference[:, 0]).max() <= 1e-10 * np.abs(reference).max()


def _curved() -> VertexBending:
    mesh = cloth(7, 6, wave=0.1)
    return VertexBending(VertexBending.Config(weight=1.0), mesh, np.ones(mesh.vertices))


_CURVED = _curved()


def half_spheres(h: np.ndarray, n: np.ndarray, magnitude: float, compiled: bool) -> np.ndarray:
    """Projections (m, 3) of the vectors h on the half spheres about the poles n."""
    if compiled:
        p, rest = np.full_like(h, np.nan), np.zeros_like(h)
        columns = (np.ones(len(h)), np.full(len(h), magnitude), rest, n)
        parameters = pack(np.column_stack(columns))
        call_kernel(_CURVED.gradient_kernel.address, h, parameters, p, len(h))
        return p
    group = copy(_CURVED)
    group.side, group.normals = np.ones(len(h)), n
    group.magnitude, group.rest = np.full(len(h), magnitude), np.zeros_like(h)
    return group.reference_project(h[:, None], np.arange(len(h)))[:, 0]


@pytest.mark.parametrize("compiled", [True, False], ids=["compiled", "reference"])
@given(
    seed=st.integers(0, 2**32 - 1),
    exponent=st.floats(-18.0, 0.0),
    length=st.floats(-100.0, 100.0),
    magnitude=st.floats(1e-3, 1e3),
)
def test_no_bending_near_the_pole_leaves_its_half_sphere(
    compiled, seed, exponent, length, magnitude
):
    """H = -n + t u: the difference of H and its part along n is round-off for small t.

    The nearest point is m u; p lies on the rim, stays where it is when it is projected again, and
    is no farther from H.
    """
    rng = np.random.default_rng(seed)
    turns = np.stack([random_rotation(rng) for _ in range(40)])
    n, u = turns[:, 0].copy(), turns[:, 1]
    h = 10.0**length * (10.0**exponent * u - n)
    p = half_spheres(h, n, magnitude, compiled) / magnitude
    assert np.abs(np.linalg.norm(p, axis=1) - 1.0).max() < 1e-14
    assert np.abs(np.einsum("ij,ij->i", p, n)).max() < 4e-12
    again = half_spheres(magnitude * p, n, magnitude, compiled) / magnitude
    assert np.abs(again - p).max() < 4e-12
    size = 10.0**length / magnitude
    distance, nearest = (np.linalg.norm(h / magnitude - q, axis=1) for q in (p, u))
    assert (distance <= nearest + 4e-12 * (size + 1.0)).all()
