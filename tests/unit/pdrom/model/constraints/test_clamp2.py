"""The closed form and the rotation of 3 x 2 projections against NumPy's singular values."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import from_python
from pdrom.model.constraints.lanes import LANES, workspace
from pdrom.model.constraints.triangle_strain import FLAT, HIGH, LOW, clamp_block

RANGE = (0.9, 1.1)
F, P, FOUND, SIZE = 0, 6, 12, 13
EPS = np.finfo(float).eps


def projected(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(projections, whether the closed form served) of matrices (m, 2, 3), m <= LANES."""
    work = workspace(SIZE)
    by_lane = work.reshape(SIZE, LANES)
    padded = np.concatenate([matrices, np.repeat(matrices[-1:], LANES - len(matrices), axis=0)])
    by_lane[F : F + 6] = padded.reshape(LANES, 6).T
    from_python(clamp_block)(work, F, P, FOUND, *RANGE)
    found = by_lane[P : P + 6].T.reshape(LANES, 2, 3)[: len(matrices)]
    return found, by_lane[FOUND, : len(matrices)] != 0.0


def matrix(rng: np.random.Generator, sigma: tuple[float, float]) -> np.ndarray:
    """Random matrix (2, 3) with singular values ``sigma``."""
    u, _ = np.linalg.qr(rng.standard_normal((3, 2)))
    v, _ = np.linalg.qr(rng.standard_normal((2, 2)))
    return (u * sigma @ v).T


def by_numpy(f: np.ndarray) -> np.ndarray:
    u, sigma, vt = np.linalg.svd(f, full_matrices=False)
    return (u * np.clip(sigma, *RANGE)) @ vt


@given(seed=st.integers(0, 10**6), large=st.floats(1e-3, 1e3), ratio=st.floats(1e-6, 1.0))
def test_projections_are_those_of_numpy(seed, large, ratio):
    f = matrix(np.random.default_rng(seed), (large, large * ratio))
    (p,), (closed,) = projected(f[None])
    # product over the mean of the squares, as the kernel decides
    measure = 2.0 * ratio / (1.0 + ratio**2)
    if not 0.999 < measure / FLAT < 1.001:
        assert closed == (measure > FLAT)
    condition = max(1.0, RANGE[1] / (large * ratio) * large)
    assert np.linalg.norm(p - by_numpy(f)) <= 40 * EPS * condition


@pytest.mark.parametrize("sigma", [(1.0, 1.0), (2.0, 2.0), (1.0, 1.0 - 1e-15), (0.5, 0.5 + 1e-12)])
def test_equal_singular_values_leave_nothing_to_tell_apart(sigma, rng):
    f = matrix(rng, sigma)
    (p,), (closed,) = projected(f[None])
    assert closed
    np.testing.assert_allclose(p, by_numpy(f), rtol=0.0, atol=10 * EPS)


@pytest.mark.parametrize("square", [LOW, HIGH])
def test_both_ways_meet_where_the_range_of_the_closed_form_ends(square, rng):
    f = matrix(rng, (1.0, 0.4))
    scales = np.sqrt(square) * np.array([0.5, 2.0])
    p, closed = projected(scales[:, None, None] * f)
    assert closed.tolist() == ([False, True] if square == LOW else [True, False])
    expected = [by_numpy(scale * f) for scale in scales]
    np.testing.assert_allclose(p, expected, rtol=0.0, atol=20 * EPS)


def test_what_the_closed_form_refuses_changes_no_other_lane(rng):
    regular = matrix(rng, (1.3, 0.7))
    (alone,), _ = projected(regular[None])
    bad = np.stack([regular, np.zeros((2, 3)), np.full((2, 3), np.nan), regular])
    p, closed = projected(bad)
    assert closed.tolist() == [True, False, False, True]
    assert (p[0] == alone).all()
    assert (p[3] == alone).all()
    assert np.isfinite(p[1]).all()
    assert np.isnan(p[2]).any()
