"""Degenerate elements: none spoils another one, and none leaves what it is projected on.

Elements with the unit simplex as rest shape have S q = F^T exactly, so that F itself is chosen.
"""

from copy import copy

import numpy as np
import pytest
from hypothesis import given
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
def test_what_is_not_finite_stays_so_and_harms_no_other(kind, bad, rng):
    group = group_of(kind, 3 * LANES)
    f = rng.standard_normal((3 * LANES, group.rows_per_element, 3))
    clean = projected(group, f)
    f[LANES + 1, 0, 1] = bad
    p = projected(group, f)
    others = np.arange(len(f)) != LANES + 1
    assert np.isnan(p[LANES + 1]).any()
    assert np.array_equal(p[others], clean[others])


@pytest.mark.parametrize("kind", KINDS)
def test_an_element_has_the_same_bits_in_any_company(kind, rng):
    """Neighbours in a block take part in the same loops, but change nothing."""
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
