"""Degenerate elements change no other element, and their projections lie on the manifold.

Elements with the unit simplex as rest shape have S q = F^T exactly, so that F can be chosen.
The compiled projections of volumes and areas are compared with bisection and their definition.
"""

from copy import copy

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from builders import bound, call_kernel, projected, random_rotation
from pdrom.model.constraints.bending import VertexBending
from pdrom.model.constraints.lanes import LANES, pack
from pdrom.model.effects import EFFECTS
from pdrom.model.mesh.generators import cloth

KINDS = ("strain", "tetrahedron_strain", "deformation_gradient", "volume", "area")


def group_of(name: str, count: int):
    kind = EFFECTS.load(name)
    return bound(kind, kind.rows_per_element, count)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("kind", KINDS)
def test_an_element_that_is_not_finite_changes_no_other_element(kind, bad, rng):
    group = group_of(kind, 3 * LANES)
    f = rng.standard_normal((3 * LANES, group.rows_per_element, 3))
    clean = projected(group, f)
    f[LANES + 1, 0, 1] = bad
    p = projected(group, f)
    others = np.arange(len(f)) != LANES + 1
    assert np.isnan(p[LANES + 1]).any()
    assert np.array_equal(p[others], clean[others])


@pytest.mark.parametrize("kind", KINDS)
def test_an_element_has_the_same_bits_whichever_elements_share_its_block(kind, rng):
    count, alone = 2 * LANES + 3, group_of(kind, 1)
    noise = rng.standard_normal((count, alone.rows_per_element, 3))
    noise *= 10.0 ** rng.uniform(-9, 1, (count, 1, 1))
    f = np.eye(3)[: alone.rows_per_element] + noise
    together = projected(group_of(kind, count), f)
    for i in range(count):
        assert np.array_equal(projected(alone, f[i : i + 1])[0], together[i])


MESH = cloth(7, 6, wave=0.1)
_CURVED = VertexBending(VertexBending.Config(weight=1.0), MESH, np.ones(MESH.vertices))


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
def test_bending_near_the_pole_stays_in_its_half_sphere(
    compiled, seed, exponent, length, magnitude
):
    """H = -n + t u: the difference of H and its part along n is a rounding error for small t.

    The nearest point is m u; p lies on the rim, stays there when it is projected again, and is no
    farther from H.
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


LOW, HIGH = 0.99, 1.01
ROWS = {"volume": 3, "area": 2}
COUNT = 40  # more than one block of lanes

# rounding errors, flat, repeated, in range, far too large, and any size
SIZES = st.one_of(
    st.sampled_from([0.0, 1e-300, 1e-17, 1e-8, 0.1, 0.99, 1.0, 1.01, 1.9, 2.0, 3.0]),
    st.floats(0.0, 4.0),
    st.floats(-6.0, 6.0).map(lambda x: 10.0**x),
)
ENDS = {"minimum": LOW, "maximum": HIGH}
GROUPS = {kind: bound(EFFECTS.load(kind), rows, COUNT, **ENDS) for kind, rows in ROWS.items()}


def signed(f: np.ndarray) -> np.ndarray:
    """Singular values (e, rows), the last with the sign of det F for three rows."""
    sigma = np.linalg.svd(f, compute_uv=False)
    if f.shape[1] == 3:
        sigma[:, 2] *= np.sign(np.linalg.det(f / sigma[:, :1, None]))
    return sigma


@st.composite
def matrices(draw, kind: str) -> np.ndarray:
    """F^T of `COUNT` elements: one set of singular values, possibly mirrored, in many rotations."""
    rows = ROWS[kind]
    sigma = np.array([draw(SIZES) for _ in range(rows)])
    if draw(st.booleans()):
        sigma[-1] = -sigma[-1]
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    turns = [(random_rotation(rng)[:rows], random_rotation(rng)[:rows, :rows]) for _ in range(3)]
    if draw(st.booleans()):
        turns.append((np.eye(rows, 3), np.eye(rows)))
    chosen = [turns[i % len(turns)] for i in range(COUNT)]
    right = [np.linalg.qr(r)[0] for _, r in chosen]
    return np.stack(
        [r.T @ (sigma[:, None] * left) for (left, _), r in zip(chosen, right, strict=True)]
    )


@pytest.mark.parametrize("kind", ROWS)
@settings(max_examples=60)
@given(data=st.data())
def test_a_projection_is_in_range_and_as_near_as_the_nearest_point_by_bisection(kind, data):
    f = data.draw(matrices(kind))
    p = projected(GROUPS[kind], f)
    reference = GROUPS[kind].reference_project(f, np.arange(COUNT))
    scale = max(np.abs(f).max(), 1.0)
    distance, nearest = (np.linalg.norm((f - x) / scale, axis=(1, 2)) for x in (p, reference))
    assert np.isfinite(p).all()
    assert (np.abs(distance - nearest) <= 1e-11).all()
    # the accuracy of the smallest singular values in a matrix of this size
    size = signed(p).prod(axis=1)
    rounding = 1e-13 * scale ** ROWS[kind]
    assert ((size >= LOW - rounding) & (size <= HIGH + rounding)).all()


@pytest.mark.parametrize("kind", ROWS)
@settings(max_examples=40)
@given(data=st.data())
def test_projecting_twice_changes_nothing_and_rotations_commute_with_projections(kind, data):
    """Q F projects to Q p for a generic F; otherwise p need not be unique."""
    f = data.draw(matrices(kind))
    assume(np.abs(f).max() < 100.0)
    once = projected(GROUPS[kind], f)
    assert np.abs(projected(GROUPS[kind], once) - once).max() <= 1e-9 * max(1.0, np.abs(once).max())
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    f, turn = rng.standard_normal(f.shape), random_rotation(rng)
    p = projected(GROUPS[kind], f)
    assert np.abs(projected(GROUPS[kind], f @ turn.T) - p @ turn.T).max() <= 1e-9 * np.abs(p).max()
