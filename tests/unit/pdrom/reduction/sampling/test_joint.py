"""The preprint's joint selection: against the definition, and where an axis system is singular."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdrom.reduction.sampling.deim import deim_entries, joint_rows

ALL = (True, True, True)
SIZES = st.tuples(st.integers(2, 30), st.integers(1, 12), st.integers(0, 2**32 - 1))


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


@given(SIZES)
def test_follows_the_definition(size):
    v = modes(size)
    before = v.copy()
    rows = joint_rows(v, ALL, False)
    np.testing.assert_array_equal(v, before)
    assert rows.tolist() == by_definition(v)
    for r in range(1, v.shape[1]):
        np.testing.assert_array_equal(joint_rows(v[:, :r], ALL, False), rows[:r])


@given(SIZES)
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
