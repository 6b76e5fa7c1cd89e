"""DEIM against pyMOR and the greedy loop; Q-DEIM against its defining factorisation."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pymor.algorithms.ei import qdeim as pymor_qdeim
from pymor.vectorarrays.numpy import NumpyVectorSpace

from pdrom.reduction.sampling.deim import TIE, deim_entries, joint_rows, tie_weights
from pdrom.reduction.sampling.qdeim import qdeim_elements

SIZES = st.tuples(st.integers(1, 60), st.integers(1, 15), st.integers(0, 2**32 - 1))


def orthonormal(size: tuple[int, int, int]) -> np.ndarray:
    """Random orthonormal columns (n, r), r <= n."""
    n, r, seed = size
    rng = np.random.default_rng(seed)
    return np.linalg.qr(rng.standard_normal((n, min(n, r))))[0]


def greedy_loop(v: np.ndarray) -> list[int]:
    """The algorithm as it is published, mode by mode, with the factors that decide ties."""
    weights = tie_weights(len(v))
    entries: list[int] = []
    for k in range(v.shape[1]):
        residual = v[:, k].copy()
        if entries:
            residual -= v[:, :k] @ np.linalg.solve(v[entries, :k], v[entries, k])
        residual[entries] = 0.0
        entries.append(int(np.argmax(weights * np.abs(residual))))
    return entries


@given(SIZES)
def test_picks_the_entries_of_the_greedy_loop(size):
    v = orthonormal(size)
    assert deim_entries(v).tolist() == greedy_loop(v)


@given(SIZES, st.integers(0, 2**32 - 1), st.floats(0.0, 1e-13))
def test_of_mirrored_entries_the_first_is_taken_whatever_round_off_says(size, seed, noise):
    """Both halves hold the same numbers, up to signs and a noise, as a symmetric motion's do."""
    rng = np.random.default_rng(seed)
    half = orthonormal(size)
    mirrored = half[::-1] * rng.choice([-1.0, 1.0], len(half))[:, None]
    v = np.vstack([half, mirrored * (1.0 + noise * rng.standard_normal(half.shape))])
    entries = deim_entries(v)
    assert entries.tolist() == greedy_loop(v)
    assert (entries < len(half)).all()


def test_equal_magnitudes_go_to_the_first_entry():
    v = np.array([[1.0, 1.0, -1.0, 1.0], [1.0, -1.0, 1.0, 1.0]]).T
    np.testing.assert_array_equal(deim_entries(v), [0, 1])
    # a larger one that is no tie is taken wherever it stands
    v = np.ones((50, 1))
    v[49] = 1.0 + 2.0 * TIE
    assert deim_entries(v).tolist() == [49]


@given(SIZES, st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_dependent_modes_get_distinct_entries_and_change_none_before(size, copies, seed):
    """Zero modes and combinations of earlier ones, exact and rounded."""
    v = orthonormal(size)
    rng = np.random.default_rng(seed)
    extra = v @ rng.standard_normal((v.shape[1], copies)) * rng.integers(0, 2, copies)
    entries = deim_entries(np.hstack([v, v[:, :1], extra]))
    np.testing.assert_array_equal(entries[: v.shape[1]], deim_entries(v))
    assert len(set(entries.tolist())) == min(len(v), v.shape[1] + 1 + copies)
    assert deim_entries(np.zeros((3, 2))).tolist() == [0, 1]


@given(SIZES)
def test_selection_is_nested_distinct_and_keeps_its_input(size):
    v = orthonormal(size)
    before = v.copy()
    entries = deim_entries(v)
    np.testing.assert_array_equal(v, before)
    assert len(set(entries.tolist())) == v.shape[1]
    for r in range(1, v.shape[1]):
        np.testing.assert_array_equal(deim_entries(v[:, :r]), entries[:r])


@given(SIZES, st.integers(0, 2**32 - 1))
def test_permuted_rows_are_picked_in_the_same_order(size, seed):
    v = orthonormal(size)
    order = np.random.default_rng(seed).permutation(len(v))
    np.testing.assert_array_equal(order[deim_entries(v[order])], deim_entries(v))


@given(SIZES, st.integers(0, 2**32 - 1))
def test_signs_of_the_modes_do_not_matter(size, seed):
    v = orthonormal(size)
    flipped = v * np.random.default_rng(seed).choice([-1.0, 1.0], v.shape[1])
    np.testing.assert_array_equal(deim_entries(flipped), deim_entries(v))


def test_known_selection():
    """v_1 peaks at entry 2; the residual of v_2 = (3, 0, 4, 0) / 5 is +-(3, -2, 0, -2) / 5."""
    v = np.array([[0.0, 1.0, 2.0, 1.0], [3.0, 0.0, 4.0, 0.0]]).T
    np.testing.assert_array_equal(deim_entries(v), [2, 0])
    np.testing.assert_array_equal(deim_entries(np.eye(4)[:, [3, 1]]), [3, 1])


@given(SIZES)
def test_qdeim_does_not_depend_on_the_basis_of_the_space(size):
    """Drmac and Gugercin 2016: V Q with orthogonal Q gives the same norms, hence the same pivots.

    A square V is left out: its rows all have norm 1, and round-off would decide among them.
    """
    v = orthonormal(size)
    assume(v.shape[0] > v.shape[1])
    q = np.linalg.qr(np.random.default_rng(size[2] + 1).standard_normal((v.shape[1],) * 2))[0]
    np.testing.assert_array_equal(qdeim_elements(v @ q, 1), qdeim_elements(v, 1))


@given(SIZES)
def test_qdeim_of_entries_picks_those_of_pymor(size):
    v = orthonormal(size)
    assume(len(v) > v.shape[1])  # a square one has no longest row
    expected = pymor_qdeim(NumpyVectorSpace(len(v)).from_numpy(v.copy()), pod=False)[0]
    np.testing.assert_array_equal(qdeim_elements(v, 1), expected)


def test_qdeim_gain_is_below_that_of_the_greedy_on_average():
    gains = []
    for seed in range(30):
        v = orthonormal((200, 20, seed))
        picks = deim_entries(v), qdeim_elements(v, 1)
        gains.append([np.linalg.norm(np.linalg.inv(v[entries]), 2) for entries in picks])
    greedy, pivoted = np.mean(gains, axis=0)
    assert pivoted < greedy


ALL = (True, True, True)
ROWS = st.tuples(st.integers(2, 30), st.integers(1, 12), st.integers(0, 2**32 - 1))


def modes(size: tuple[int, int, int]) -> np.ndarray:
    """Random orthonormal modes (3 rows, r), r <= rows."""
    rows, r, seed = size
    rng = np.random.default_rng(seed)
    return np.linalg.qr(rng.standard_normal((3 * rows, min(rows, r))))[0]


def by_definition(v: np.ndarray) -> list[int]:
    """The selection written out with three dense solves a mode."""
    axes = [v[a::3] for a in range(3)]
    picked: list[int] = []
    for k in range(v.shape[1]):
        squared = np.zeros(len(v) // 3)
        for basis in axes:
            residual = basis[:, k]
            if picked:
                c = np.linalg.solve(basis[picked, :k], basis[picked, k])
                residual = residual - basis[:, :k] @ c
            squared += residual**2
        picked.append(int(np.argmax(squared)))
    return picked


@given(ROWS)
def test_follows_the_definition(size):
    v = modes(size)
    before = v.copy()
    rows = joint_rows(v, ALL, False)
    np.testing.assert_array_equal(v, before)
    assert rows.tolist() == by_definition(v)
    for r in range(1, v.shape[1]):
        np.testing.assert_array_equal(joint_rows(v[:, :r], ALL, False), rows[:r])


@given(ROWS)
def test_one_active_axis_is_classical_deim_on_it(size):
    rows, r, seed = size
    rng = np.random.default_rng(seed)
    v = np.zeros((3 * rows, min(rows, r)))
    v[1::3] = np.linalg.qr(rng.standard_normal((rows, min(rows, r))))[0]
    picked = joint_rows(v, (False, True, False), False)
    np.testing.assert_array_equal(picked, deim_entries(v[1::3]))


def test_round_off_axis_has_no_say(rng):
    v = modes((30, 8, 1))
    v[2::3] = 1e-16 * rng.standard_normal((30, 8))
    flat = v.copy()
    flat[2::3] = 0.0
    active = (True, True, False)
    np.testing.assert_array_equal(joint_rows(v, active, False), joint_rows(flat, active, False))


@pytest.mark.parametrize("repeat", [False, True])
def test_singular_axis_system_raises_nothing_and_is_deterministic(repeat):
    """The z part of every mode is zero although the axis counts: a 0 x 0 information system."""
    v = modes((30, 8, 2))
    v[2::3] = 0.0
    rows = joint_rows(v, ALL, repeat)
    assert len(rows) == 8
    assert ((rows >= 0) & (rows < 30)).all()
    np.testing.assert_array_equal(joint_rows(v, ALL, repeat), rows)


def test_rows_repeat_only_where_allowed():
    """Equal second mode: its residual vanishes, so that the largest is the first row again."""
    v = np.repeat(modes((10, 1, 3)), 3, axis=1)
    assert len(set(joint_rows(v, ALL, False).tolist())) == 3
    flat = np.zeros_like(v)
    assert joint_rows(flat, ALL, True).tolist() == [0, 0, 0]
    assert joint_rows(flat, ALL, False).tolist() == [0, 1, 2]


def test_ends_when_every_row_is_taken():
    v = np.linalg.qr(np.random.default_rng(4).standard_normal((12, 9)))[0]
    assert sorted(joint_rows(v, ALL, False).tolist()) == [0, 1, 2, 3]
    assert len(joint_rows(v, ALL, True)) == 9
