"""Thin QR against its definition, LAPACK's reflections, and matrices that defeat the fast way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import linalg

from pdrom.reduction.basis import pod as module
from pdrom.reduction.basis.pod import thin_qr

SHAPES = st.tuples(st.integers(1, 60), st.integers(1, 12), st.integers(0, 2**32 - 1))


def tall(shape: tuple[int, int, int]) -> np.ndarray:
    """Random matrix (n + m, m) whose columns have very different sizes, the last one dependent."""
    n, m, seed = shape
    rng = np.random.default_rng(seed)
    matrix = rng.standard_normal((n + m, m)) * 10.0 ** rng.uniform(-6, 6, m)
    matrix[:, -1] = matrix[:, :-1].sum(axis=1)
    return matrix


def check(matrix: np.ndarray) -> None:
    """A = Q R column by column, Q^T Q = I, R upper triangular."""
    before = matrix.copy()
    first, second, r = thin_qr(matrix)
    np.testing.assert_array_equal(matrix, before)
    q = first @ linalg.inv(second)
    assert np.abs(q.T @ q - np.eye(len(r))).max() < 1e-13
    np.testing.assert_array_equal(np.tril(r, -1), 0.0)
    error = np.linalg.norm(q @ r - matrix, axis=0)
    assert (error <= 1e-13 * np.linalg.norm(matrix, axis=0)).all()


@given(SHAPES)
def test_is_a_factorisation_with_orthonormal_columns(shape):
    check(tall(shape))


@pytest.mark.parametrize("scale", [1e-290, 1e140])
def test_keeps_its_accuracy_at_every_size(scale):
    check(scale * tall((50, 8, 1)))


def growing(m: int) -> np.ndarray:
    """LU with partial pivoting leaves L = -1 below the diagonal, of condition m 2^(m-1)."""
    return np.vstack([np.eye(m) - np.tril(np.ones((m, m)), -1), np.zeros((3, m))])


@pytest.mark.parametrize("m", [30, 70])
def test_an_ill_conditioned_factor_is_noticed(m, monkeypatch):
    """For m = 70 the first Cholesky factorisation fails, for 30 the departure tells."""
    calls = []
    reflect = module._by_reflections

    def counted(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        calls.append(matrix.shape)
        return reflect(matrix)

    monkeypatch.setattr(module, "_by_reflections", counted)
    check(growing(m))
    assert calls == [(m + 3, m)]


def test_zero_has_no_direction_of_its_own():
    first, second, r = thin_qr(np.zeros((5, 2)))
    np.testing.assert_allclose((first.T @ first), second.T @ second)
    np.testing.assert_array_equal(r, 0.0)
