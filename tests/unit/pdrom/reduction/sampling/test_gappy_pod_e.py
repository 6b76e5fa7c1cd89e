"""GappyPOD+E against its published loop, dense eigenvalues and the best subset."""

import itertools

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdrom.core.errors import SamplingError
from pdrom.reduction.sampling.deim import block_elements
from pdrom.reduction.sampling.gappy_pod_e import eigenvalue_growth, oversample
from pdrom.reduction.sampling.qdeim import qdeim_elements

SIZES = st.tuples(
    st.integers(3, 25), st.sampled_from([1, 3, 6]), st.integers(1, 9), st.integers(0, 2**32 - 1)
).filter(lambda s: s[2] <= s[0])


def modes(size: tuple[int, int, int, int]) -> np.ndarray:
    """Random orthonormal modes (rows * elements, r), some elements far larger than others."""
    elements, rows, r, seed = size
    rng = np.random.default_rng(seed)
    scale = np.repeat(10.0 ** rng.uniform(-2, 1, elements), rows)
    return np.linalg.qr(rng.standard_normal((elements * rows, r)) * scale[:, None])[0]


def gain(v: np.ndarray, size: int, elements) -> float:
    """1 / sigma_min of the sampled rows, from a dense SVD."""
    rows = v.reshape(-1, size, v.shape[1])[np.asarray(elements)].reshape(-1, v.shape[1])
    smallest = np.linalg.svd(rows, compute_uv=False)[-1] if len(rows) >= v.shape[1] else 0.0
    return 1.0 / smallest if smallest > 1e-14 else np.inf


def published_loop(u: np.ndarray, count: int) -> list[int]:
    """The loop of Peherstorfer, Drmac and Gugercin 2020 (algorithm 1) with dense SVDs."""
    picked = qdeim_elements(u, 1).tolist()
    while len(picked) < count:
        _, s, w = np.linalg.svd(u[picked], full_matrices=False)
        gap = s[-2] ** 2 - s[-1] ** 2
        rotated = w @ u.T
        length = gap + np.sum(rotated**2, axis=0)
        bound = length - np.sqrt(length**2 - 4.0 * gap * rotated[-1] ** 2)
        picked.append(next(int(i) for i in np.argsort(-bound) if i not in picked))
    return picked


@pytest.mark.parametrize("seed", range(20))
def test_selected_rows_follow_the_published_loop(seed):
    v = modes((40, 1, 6, seed))
    assert oversample(v, 1, qdeim_elements(v, 1), 25).tolist() == published_loop(v, 25)


@given(SIZES)
def test_the_eigenvalue_growth_is_a_lower_bound_and_exact_for_one_mode(size):
    """Reference: dense eigenvalues of G + B^T B; at most |B u|^2, attained for r = 1."""
    v = modes(size)
    blocks = v.reshape(size[0], size[1], -1)
    rows = blocks[: max(1, size[0] // 2)].reshape(-1, v.shape[1])
    gram = rows.T @ rows
    values, vectors = np.linalg.eigh(gram)
    products = blocks @ vectors[:, 0]
    gap = values[1] - values[0] if len(values) > 1 else np.inf
    bound = eigenvalue_growth(blocks, products, vectors[:, 0], gap)
    true = np.array([np.linalg.eigvalsh(gram + b.T @ b)[0] for b in blocks]) - values[0]
    assert (bound >= 0.0).all()
    assert (bound <= true + 1e-12).all()
    assert (true <= np.sum(products**2, axis=1) + 1e-12).all()
    if v.shape[1] == 1:
        np.testing.assert_allclose(bound, true, atol=1e-12)


@pytest.mark.parametrize("offset", [0.0, *(10.0**k for k in range(-16, 0))])
@pytest.mark.parametrize("side", [0.0, *(10.0**k for k in range(-20, -4, 3))])
def test_the_eigenvalue_growth_is_accurate_near_a_double_root(offset, side):
    """One row (b, sqrt(c)) and a gap near |b|^2; reference: the exact root in 60 digits."""
    gap, b = 0.37, np.sqrt(0.37) * (1.0 + offset)
    row = np.array([[[b, np.sqrt(side)]]])
    with mpmath.workdps(60):
        g, square, c = mpmath.mpf(gap), mpmath.mpf(b) ** 2, mpmath.mpf(row[0, 0, 1]) ** 2
        total = g + square + c
        root = (total - mpmath.sqrt(total**2 - 4 * g * square)) / 2
        found = eigenvalue_growth(row, row @ np.eye(2)[0], np.eye(2)[0], gap)[0]
        assert abs(found - root) <= 1e-14 * root


@given(SIZES)
def test_each_element_has_the_largest_bound_and_none_raises_the_deim_constant(size):
    v = modes(size)
    before = v.copy()
    start = block_elements(v, size[1])
    path = oversample(v, size[1], start, size[0])
    np.testing.assert_array_equal(v, before)
    assert path[: len(start)].tolist() == start.tolist()
    assert sorted(path.tolist()) == list(range(size[0]))
    gains = [gain(v, size[1], path[:k]) for k in range(len(start), len(path) + 1)]
    assert all(b <= a * (1.0 + 1e-9) for a, b in itertools.pairwise(gains))
    blocks = v.reshape(size[0], size[1], -1)
    for k in range(len(start), len(path)):
        rows = blocks[path[:k]].reshape(-1, v.shape[1])
        values, vectors = np.linalg.eigh(rows.T @ rows)
        gap = values[1] - values[0] if len(values) > 1 else np.inf
        bound = eigenvalue_growth(blocks, blocks @ vectors[:, 0], vectors[:, 0], gap)
        bound[path[:k]] = 0.0
        assert bound[path[k]] >= bound.max() * (1.0 - 1e-6) - 1e-12


@given(SIZES, st.floats(1.01, 50.0))
def test_a_bounded_deim_constant_is_reached_with_as_few_elements_as_possible(size, bound):
    """Orthonormal modes have the constant 1 at all elements, so that every bound can be reached."""
    v = modes(size)
    start = block_elements(v, size[1])
    chosen = oversample(v, size[1], start, bound=bound)
    assert gain(v, size[1], chosen) <= bound * (1.0 + 1e-9)
    if len(chosen) > len(start):
        assert gain(v, size[1], chosen[:-1]) > bound * (1.0 - 1e-9)
    path = oversample(v, size[1], start, len(chosen))
    np.testing.assert_array_equal(chosen, path)


@pytest.mark.parametrize("start", [[1, 1], [0, 10], [-1]])
def test_faulty_starts_are_named(start, rng):
    v = np.linalg.qr(rng.standard_normal((30, 3)))[0]
    with pytest.raises(SamplingError, match="0 to 9"):
        oversample(v, 3, np.array(start), 5)
