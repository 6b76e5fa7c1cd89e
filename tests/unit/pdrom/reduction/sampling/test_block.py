"""Selections of whole elements."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pdrom.reduction.sampling.deim import block_elements, deim_entries, tie_weights
from pdrom.reduction.sampling.qdeim import qdeim_elements

Select = Callable[[np.ndarray, int], np.ndarray]
SIZES = st.tuples(
    st.integers(1, 25), st.sampled_from([3, 6, 9]), st.integers(1, 14), st.integers(0, 2**32 - 1)
)
both = pytest.mark.parametrize("algorithm", [block_elements, qdeim_elements])


def modes(size: tuple[int, int, int, int]) -> np.ndarray:
    """Random orthonormal modes (rows * elements, r).

    A square one has rows of norm 1 only: pivots are ties there, and tests of their order skip it.
    """
    elements, rows, r, seed = size
    rng = np.random.default_rng(seed)
    n = elements * rows
    return np.linalg.qr(rng.standard_normal((n, min(n, r))))[0]


def sampled(v: np.ndarray, elements: np.ndarray, size: int) -> np.ndarray:
    """Rows of ``v`` that belong to the elements."""
    return v.reshape(-1, size, v.shape[1])[elements].reshape(-1, v.shape[1])


@both
@given(size=SIZES)
def test_one_distinct_element_per_mode_of_full_rank(algorithm: Select, size):
    v = modes(size)
    before = v.copy()
    elements = algorithm(v, size[1])
    np.testing.assert_array_equal(v, before)
    assert len(set(elements.tolist())) == len(elements) == min(v.shape[1], size[0])
    assert np.linalg.matrix_rank(sampled(v, elements, size[1])) == v.shape[1]


@both
@given(size=SIZES, seed=st.integers(0, 2**32 - 1))
def test_permuted_elements_are_picked_in_the_same_order(algorithm: Select, size, seed):
    v = modes(size)
    assume(v.shape[0] > v.shape[1])
    order = np.random.default_rng(seed).permutation(size[0])
    permuted = v.reshape(size[0], size[1], -1)[order].reshape(v.shape)
    np.testing.assert_array_equal(order[algorithm(permuted, size[1])], algorithm(v, size[1]))


@given(SIZES)
def test_greedy_is_nested(size):
    v = modes(size)
    elements = block_elements(v, size[1])
    for r in range(1, v.shape[1]):
        nested = block_elements(v[:, :r], size[1])
        np.testing.assert_array_equal(nested, elements[: len(nested)])


@given(SIZES)
def test_single_entries_as_elements_are_classical_deim(size):
    v = modes((size[0], 1, size[2], size[3]))
    assume(v.shape[0] > v.shape[1])
    np.testing.assert_array_equal(block_elements(v, 1), deim_entries(v))


def qdeim_loop(v: np.ndarray, size: int) -> list[int]:
    """Q-DEIM as its docstring says, all groups touched at every step."""
    left, weights = v.copy(), tie_weights(len(v) // size)
    picked: list[int] = []
    for _ in range(min(v.shape[1], len(weights))):
        norms = weights * np.linalg.norm(left.reshape(len(weights), -1), axis=1)
        norms[picked] = -1.0
        picked.append(int(np.argmax(norms)))
        group = left[size * picked[-1] : size * (picked[-1] + 1)]
        direction = np.linalg.svd(group)[2][0]
        left -= np.outer(left @ direction, direction)
    return picked


@given(SIZES)
def test_qdeim_follows_its_definition(size):
    v = modes(size)
    assert qdeim_elements(v, size[1]).tolist() == qdeim_loop(v, size[1])


def spread(kind: str, n: int = 1800, r: int = 24) -> np.ndarray:
    """Modes (n, r) of many rows of which few matter, all, or mirrored pairs."""
    rng = np.random.default_rng(5)
    v = rng.standard_normal((n, r))
    if kind == "few":
        v *= np.exp(-0.02 * rng.permutation(n))[:, None]
    if kind == "twelve decades":
        v[: n // 2] *= 1e12
    if kind == "mirrored":
        v[n // 2 :] = v[n // 2 - 1 :: -1]
    return v if kind == "twelve decades" else np.linalg.qr(v)[0]


@pytest.mark.parametrize("size", [1, 3, 9])
@pytest.mark.parametrize("kind", ["even", "few", "twelve decades", "mirrored"])
def test_qdeim_among_candidates_is_qdeim_of_all(kind, size):
    """There are far more elements than the candidates that are looked at."""
    v = spread(kind)
    assert qdeim_elements(v, size).tolist() == qdeim_loop(v, size)


@pytest.mark.parametrize("size", [1, 3])
def test_qdeim_of_dependent_modes_takes_distinct_elements(size):
    v = spread("even")
    elements = qdeim_elements(np.hstack([v, v[:, :2], np.zeros((len(v), 1))]), size)
    assert len(set(elements.tolist())) == v.shape[1] + 3
    assert np.linalg.matrix_rank(sampled(v, elements, size)) == v.shape[1]
    assert qdeim_elements(np.zeros((12, 3)), size).tolist() == [0, 1, 2]


@both
@given(size=SIZES)
def test_more_elements_have_a_smaller_gain(algorithm: Select, size):
    """sigma_min of a matrix does not fall when rows are added."""
    v = modes(size)
    elements = algorithm(v, size[1])
    smallest = [
        np.linalg.svd(sampled(v, elements[:k], size[1]), compute_uv=False)[-1]
        for k in range(1, len(elements) + 1)
        if k * size[1] >= v.shape[1]
    ]
    assert (np.diff(smallest) >= -1e-14).all()


@both
def test_modes_of_separate_elements_are_found_in_order(algorithm: Select):
    """Mode k lives on one element alone; magnitudes are equal, so that ties go to the first."""
    v = np.zeros((15, 3))
    v[12, 0] = v[4, 1] = v[7, 2] = 1.0
    expected = [4, 1, 2] if algorithm is block_elements else [1, 2, 4]
    assert algorithm(v, 3).tolist() == expected


@both
def test_modes_that_live_on_few_elements_do_not_stop_the_selection(algorithm: Select, rng):
    """Two elements hold all three modes; the third pick finds nothing but must be another one."""
    v = np.zeros((15, 3))
    v[3:9] = np.linalg.qr(rng.standard_normal((6, 3)))[0]
    elements = algorithm(v, 3)
    assert len(set(elements.tolist())) == 3
    assert {1, 2} <= set(elements.tolist())
    assert np.linalg.matrix_rank(sampled(v, elements, 3)) == 3


def test_greedy_residual_uses_all_entries_of_the_picked_element():
    """All entries of element 0 give coefficient 0, its first one alone 1 and then element 1."""
    v = np.zeros((9, 2))
    v[0:3, 0], v[0:3, 1] = [2.0, 1.0, 0.0], [2.0, -4.0, 0.0]
    v[3, 0], v[8, 1] = 1.0, 0.1
    assert block_elements(v, 3).tolist() == [0, 2]


@given(SIZES)
def test_greedy_follows_its_definition(size):
    """Residual of each mode with dense pseudo-inverses, element by element."""
    v = modes(size)
    picked: list[int] = []
    for k in range(min(v.shape[1], size[0])):
        residual = v[:, k]
        if k:
            rows = sampled(v, np.array(picked), size[1])
            residual = residual - v[:, :k] @ (np.linalg.pinv(rows[:, :k]) @ rows[:, k])
        norms = np.linalg.norm(residual.reshape(size[0], size[1]), axis=1)
        norms[picked] = -1.0
        picked.append(int(np.argmax(norms)))
    assert block_elements(v, size[1]).tolist() == picked
