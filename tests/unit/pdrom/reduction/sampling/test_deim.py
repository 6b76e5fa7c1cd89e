"""DEIM and Q-DEIM of entries, rows and elements, against pyMOR and their definitions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymor.algorithms.ei import deim as pymor_deim
from pymor.algorithms.ei import qdeim as pymor_qdeim
from pymor.vectorarrays.numpy import NumpyVectorSpace

from pdrom.reduction.sampling.deim import block_elements, deim_entries, joint_rows, tie_weights
from pdrom.reduction.sampling.qdeim import qdeim_elements
from strategies import SEEDS

# rows and modes of entries; elements, rows of an element and modes
SIZES = st.tuples(st.integers(1, 60), st.integers(1, 15), SEEDS)
BLOCKS = st.tuples(st.integers(1, 25), st.sampled_from([1, 3, 6, 9]), st.integers(1, 14), SEEDS)
ALL = (True, True, True)
KINDS = ("orthonormal", "local", "decaying", "dependent")


def bases(size: tuple[int, int, int], kind: str = "orthonormal") -> np.ndarray:
    """Bases (n, r), r <= n: random, of localised modes, decaying before orthonormalisation, not
    orthonormal with columns that nearly depend on each other."""
    n, r, seed = size[0], min(size[:2]), size[2]
    rng = np.random.default_rng(seed)
    v = rng.standard_normal((n, r))
    if kind == "local":
        v *= np.exp(-0.5 * (np.linspace(0, r, n)[:, None] - np.arange(r)) ** 2)
    if kind == "decaying":
        v = v @ np.triu(rng.standard_normal((r, r))) * 10.0 ** -np.arange(r)
    if kind == "dependent":
        return v[:, :1] + 1e-5 * v
    return np.linalg.qr(v)[0]


def blocks(size: tuple[int, int, int, int]) -> np.ndarray:
    """Random orthonormal modes (rows * elements, r)."""
    return bases((size[0] * size[1], *size[2:]))


def sampled(v: np.ndarray, elements: np.ndarray, size: int) -> np.ndarray:
    """Rows of ``v`` that belong to the elements."""
    return v.reshape(-1, size, v.shape[1])[elements].reshape(-1, v.shape[1])


@given(SIZES, SEEDS, st.floats(0.0, 1e-13))
def test_of_mirrored_entries_the_first_is_selected_despite_rounding_errors(size, seed, noise):
    """Both halves have equal entries up to signs and noise, as for symmetric trajectories."""
    rng = np.random.default_rng(seed)
    half = bases(size)
    mirrored = half[::-1] * rng.choice([-1.0, 1.0], len(half))[:, None]
    v = np.vstack([half, mirrored * (1.0 + noise * rng.standard_normal(half.shape))])
    entries = deim_entries(v)
    np.testing.assert_array_equal(entries, deim_entries(half))


@given(SIZES, st.integers(1, 4), SEEDS)
def test_dependent_modes_select_distinct_entries_and_keep_earlier_selections(size, copies, seed):
    """Zero modes and combinations of earlier ones, exact and rounded."""
    v = bases(size)
    rng = np.random.default_rng(seed)
    extra = v @ rng.standard_normal((v.shape[1], copies)) * rng.integers(0, 2, copies)
    entries = deim_entries(np.hstack([v, v[:, :1], extra]))
    np.testing.assert_array_equal(entries[: v.shape[1]], deim_entries(v))
    assert len(set(entries.tolist())) == min(len(v), v.shape[1] + 1 + copies)
    assert deim_entries(np.zeros((3, 2))).tolist() == [0, 1]


def by_definition(parts: list[np.ndarray], total: int) -> list[int]:
    """The greedy selection of blocks, written out with dense pseudo-inverses part by part."""
    picked: list[int] = []
    for k in range(min(parts[0].shape[1], total)):
        squared = np.zeros(total)
        for basis in parts:
            residual, size = basis[:, k], len(basis) // total
            if k:
                rows = sampled(basis, np.array(picked), size)
                residual = residual - basis[:, :k] @ (np.linalg.pinv(rows[:, :k]) @ rows[:, k])
            squared += np.square(residual).reshape(total, size).sum(axis=1)
        squared[picked] = -1.0
        picked.append(int(np.argmax(squared)))
    return picked


@given(BLOCKS)
def test_the_greedy_selection_follows_its_definition(size):
    """For elements, and for rows with a system for each axis; selections are nested in modes."""
    v, w = blocks(size), blocks((size[0], 3, *size[2:]))
    before = v.copy(), w.copy()
    assert block_elements(v, size[1]).tolist() == by_definition([v], size[0])
    rows = joint_rows(w, ALL, False)
    assert rows.tolist() == by_definition([w[a::3] for a in range(3)], size[0])
    for r in range(1, len(rows)):
        np.testing.assert_array_equal(joint_rows(w[:, :r], ALL, False), rows[:r])
    np.testing.assert_equal((v, w), before)


def test_rows_repeat_only_where_allowed():
    """With an equal second mode the residual vanishes, so that the first row is largest again."""
    v = np.repeat(blocks((10, 3, 1, 3)), 3, axis=1)
    assert len(set(joint_rows(v, ALL, False).tolist())) == 3
    flat = np.zeros_like(v)
    assert joint_rows(flat, ALL, True).tolist() == [0, 0, 0]
    assert joint_rows(flat, ALL, False).tolist() == [0, 1, 2]
    # otherwise the selection ends when every row is selected
    v = blocks((4, 3, 9, 4))
    assert sorted(joint_rows(v, ALL, False).tolist()) == [0, 1, 2, 3]
    assert len(joint_rows(v, ALL, True)) == 9


def qdeim_loop(v: np.ndarray, size: int) -> list[int]:
    """Q-DEIM by its definition, with all groups in every step."""
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


@given(BLOCKS)
def test_qdeim_follows_its_definition(size):
    v = blocks(size)
    before = v.copy()
    assert qdeim_elements(v, size[1]).tolist() == qdeim_loop(v, size[1])
    np.testing.assert_array_equal(v, before)


def spread(kind: str, n: int = 1800, r: int = 24) -> np.ndarray:
    """Modes (n, r) of many rows with few large ones, all alike, or in mirrored pairs."""
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
def test_qdeim_among_candidates_selects_the_elements_of_qdeim_among_all(kind, size):
    v = spread(kind)
    assert qdeim_elements(v, size).tolist() == qdeim_loop(v, size)


@pytest.mark.parametrize("size", [1, 3])
def test_qdeim_of_dependent_modes_selects_distinct_elements(size):
    v = spread("even")
    elements = qdeim_elements(np.hstack([v, v[:, :2], np.zeros((len(v), 1))]), size)
    assert len(set(elements.tolist())) == v.shape[1] + 3
    assert np.linalg.matrix_rank(sampled(v, elements, size)) == v.shape[1]
    assert qdeim_elements(np.zeros((12, 3)), size).tolist() == [0, 1, 2]


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=40)
@given(size=SIZES)
def test_deim_and_qdeim_select_the_entries_of_pymor(kind, size):
    v = bases(size, kind)
    before = v.copy()
    theirs = pymor_deim(NumpyVectorSpace.from_numpy(v), pod=False)[0]
    np.testing.assert_array_equal(deim_entries(v), theirs)
    if kind == "orthonormal" and len(v) > v.shape[1]:  # a square matrix has no longest row
        theirs = pymor_qdeim(NumpyVectorSpace(len(v)).from_numpy(v.copy()), pod=False)[0]
        np.testing.assert_array_equal(qdeim_elements(v, 1), theirs)
    np.testing.assert_array_equal(v, before)
