"""Volumes and areas: the compiled projections against bisection, and against their definition."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from builders import bound, projected, random_rotation
from pdrom.model.constraints.products import reference_nearest
from pdrom.model.effects import EFFECTS

LOW, HIGH = 0.99, 1.01
KINDS = {"volume": 3, "area": 2}
COUNT = 40  # more than a block of lanes

# round-off, flat, repeated, in range, far too large, and any size
SIZES = st.one_of(
    st.sampled_from([0.0, 1e-300, 1e-17, 1e-8, 0.1, 0.99, 1.0, 1.01, 1.9, 2.0, 3.0]),
    st.floats(0.0, 4.0),
    st.floats(-6.0, 6.0).map(lambda x: 10.0**x),
)
ENDS = {"minimum": LOW, "maximum": HIGH}
GROUPS = {kind: bound(EFFECTS.load(kind), rows, COUNT, **ENDS) for kind, rows in KINDS.items()}


def signed(f: np.ndarray) -> np.ndarray:
    """Singular values (e, rows), the last with the sign of det F for three rows."""
    sigma = np.linalg.svd(f, compute_uv=False)
    if f.shape[1] == 3:
        sigma[:, 2] *= np.sign(np.linalg.det(f / sigma[:, :1, None]))
    return sigma


@st.composite
def matrices(draw, kind: str) -> np.ndarray:
    """F^T of `COUNT` elements: one set of singular values, maybe mirrored, in many frames."""
    rows = KINDS[kind]
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


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=60)
@given(data=st.data())
def test_the_projection_is_in_range_and_as_near_as_bisection_finds(kind, data):
    f = data.draw(matrices(kind))
    p = projected(GROUPS[kind], f)
    reference = GROUPS[kind].reference_project(f, np.arange(COUNT))
    scale = max(np.abs(f).max(), 1.0)
    distance, nearest = (np.linalg.norm((f - x) / scale, axis=(1, 2)) for x in (p, reference))
    assert np.isfinite(p).all()
    assert (np.abs(distance - nearest) <= 1e-11).all()
    # what a matrix of this size can hold of its smallest singular values
    size = signed(p).prod(axis=1)
    rounding = 1e-13 * scale ** KINDS[kind]
    assert ((size >= LOW - rounding) & (size <= HIGH + rounding)).all()


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=40)
@given(data=st.data())
def test_projecting_twice_changes_nothing_and_turns_commute(kind, data):
    """Q F projects to Q p, for a generic F: of others p need not be unique."""
    f = data.draw(matrices(kind))
    assume(np.abs(f).max() < 100.0)
    once = projected(GROUPS[kind], f)
    assert np.abs(projected(GROUPS[kind], once) - once).max() <= 1e-9 * max(1.0, np.abs(once).max())
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    f, turn = rng.standard_normal(f.shape), random_rotation(rng)
    p = projected(GROUPS[kind], f)
    assert np.abs(projected(GROUPS[kind], f @ turn.T) - p @ turn.T).max() <= 1e-9 * np.abs(p).max()


def test_an_element_blown_up_far_enough_gives_way_along_one_axis():
    """The nearest triple of product 1: all alike below a factor of about 1.94 a side, one above."""
    alike = reference_nearest(np.full((1, 3), 1.9), 1.0, 1.0)[0]
    flat = reference_nearest(np.full((1, 3), 2.1), 1.0, 1.0)[0]
    assert alike == pytest.approx(np.ones(3), abs=1e-12)
    assert flat[0] == pytest.approx(flat[1], abs=1e-12)
    assert flat[2] < 0.5 * flat[0]
    assert flat.prod() == pytest.approx(1.0, abs=1e-12)
