"""DEIM and Q-DEIM of entries, rows and whole elements, against pyMOR and their definitions."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pymor.algorithms.ei import deim as pymor_deim
from pymor.algorithms.ei import qdeim as pymor_qdeim
from pymor.vectorarrays.numpy import NumpyVectorSpace

from pdrom.reduction.sampling.deim import TIE, block_elements, deim_entries, joint_rows, tie_weights
from pdrom.reduction.sampling.qdeim import qdeim_elements
from strategies import SEEDS

Select = Callable[[np.ndarray, int], np.ndarray]
# rows and modes of entries; elements, rows of an element and modes; rows of three axes and modes
SIZES = st.tuples(st.integers(1, 60), st.integers(1, 15), SEEDS)
BLOCKS = st.tuples(st.integers(1, 25), st.sampled_from([1, 3, 6, 9]), st.integers(1, 14), SEEDS)
ROWS = st.tuples(st.integers(2, 30), st.integers(1, 12), SEEDS)
ALL = (True, True, True)
both = pytest.mark.parametrize("algorithm", [block_elements, qdeim_elements])


def orthonormal(size: tuple[int, int, int]) -> np.ndarray:
    """Random orthonormal columns (n, r), r <= n.

    A square one has rows of norm 1 only: pivots are ties there, and tests of their order skip it.
    """
    n, r, seed = size
    return np.linalg.qr(np.random.default_rng(seed).standard_normal((n, min(n, r))))[0]


def blocks(size: tuple[int, int, int, int]) -> np.ndarray:
    """Random orthonormal modes (rows * elements, r)."""
    return orthonormal((size[0] * size[1], *size[2:]))


def modes(size: tuple[int, int, int]) -> np.ndarray:
    """Random orthonormal modes (3 rows, r), r <= rows."""
    return orthonormal((3 * size[0], min(size[:2]), size[2]))


def sampled(v: np.ndarray, elements: np.ndarray, size: int) -> np.ndarray:
    """Rows of ``v`` that belong to the elements."""
    return v.reshape(-1, size, v.shape[1])[elements].reshape(-1, v.shape[1])


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


@given(SIZES, SEEDS, st.floats(0.0, 1e-13))
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


@given(SIZES, st.integers(1, 4), SEEDS)
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


@given(SIZES, SEEDS)
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


@both
@given(size=BLOCKS)
def test_one_distinct_element_per_mode_of_full_rank(algorithm: Select, size):
    v = blocks(size)
    before = v.copy()
    elements = algorithm(v, size[1])
    np.testing.assert_array_equal(v, before)
    assert len(set(elements.tolist())) == len(elements) == min(v.shape[1], size[0])
    assert np.linalg.matrix_rank(sampled(v, elements, size[1])) == v.shape[1]


@both
@given(size=BLOCKS, seed=SEEDS)
def test_permuted_elements_are_picked_in_the_same_order(algorithm: Select, size, seed):
    v = blocks(size)
    assume(v.shape[0] > v.shape[1])
    order = np.random.default_rng(seed).permutation(size[0])
    permuted = v.reshape(size[0], size[1], -1)[order].reshape(v.shape)
    np.testing.assert_array_equal(order[algorithm(permuted, size[1])], algorithm(v, size[1]))


@given(BLOCKS)
def test_greedy_is_nested(size):
    v = blocks(size)
    elements = block_elements(v, size[1])
    for r in range(1, v.shape[1]):
        nested = block_elements(v[:, :r], size[1])
        np.testing.assert_array_equal(nested, elements[: len(nested)])


@given(BLOCKS)
def test_single_entries_as_elements_are_classical_deim(size):
    v = blocks((size[0], 1, *size[2:]))
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


@given(BLOCKS)
def test_qdeim_follows_its_definition(size):
    v = blocks(size)
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
@given(size=BLOCKS)
def test_more_elements_have_a_smaller_gain(algorithm: Select, size):
    """sigma_min of a matrix does not fall when rows are added."""
    v = blocks(size)
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


@given(BLOCKS)
def test_greedy_follows_its_definition(size):
    """Residual of each mode with dense pseudo-inverses, element by element."""
    v = blocks(size)
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


SHAPES = st.tuples(st.integers(2, 60), st.integers(1, 12)).filter(lambda s: s[1] <= s[0])


def bases(n: int, r: int, seed: int, kind: str) -> np.ndarray:
    """Bases (n, r): random, of localised modes, decaying before orthonormalisation, not orthonormal
    with columns that nearly depend on each other."""
    rng = np.random.default_rng(seed)
    v = rng.standard_normal((n, r))
    if kind == "local":
        v *= np.exp(-0.5 * (np.linspace(0, r, n)[:, None] - np.arange(r)) ** 2)
    if kind == "decaying":
        v = v @ np.triu(rng.standard_normal((r, r))) * 10.0 ** -np.arange(r)
    if kind == "dependent":
        return v[:, :1] + 1e-5 * v
    return np.linalg.qr(v)[0]


KINDS = ["random", "local", "decaying", "dependent"]


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=40)
@given(size=SHAPES, seed=SEEDS)
def test_entries_are_those_of_pymor(kind, size, seed):
    v = bases(*size, seed, kind)
    theirs = pymor_deim(NumpyVectorSpace.from_numpy(v), pod=False)[0]
    np.testing.assert_array_equal(deim_entries(v), theirs)


BOUNDS = {
    # Drmac and Gugercin 2016, theorem 2.1
    "q-deim": lambda n, r: np.sqrt(n - r + 1) * np.sqrt(4.0**r + 6 * r - 1) / 3,
    # Sorensen and Embree 2016, lemma 4.4
    "deim": lambda n, r: np.sqrt(n * r / 3) * 2.0**r,
}


@pytest.mark.parametrize("method", BOUNDS)
@pytest.mark.parametrize("kind", ["random", "local", "decaying"])
@settings(max_examples=40)
@given(size=SHAPES, seed=SEEDS)
def test_gain_is_below_its_bound(method, kind, size, seed):
    v = bases(*size, seed, kind)
    entries = deim_entries(v) if method == "deim" else qdeim_elements(v, 1)
    gain = 1.0 / np.linalg.svd(v[entries], compute_uv=False)[-1]
    assert 1.0 - 1e-12 <= gain <= BOUNDS[method](*size) * (1 + 1e-9)
