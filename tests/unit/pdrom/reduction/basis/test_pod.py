"""POD against a dense SVD and pyMOR; its orthonormality, accuracy and sign convention."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymor.algorithms.pod import pod as pymor_pod
from pymor.vectorarrays.numpy import NumpyVectorSpace
from scipy import linalg

from pdrom.reduction import basis as module
from pdrom.reduction.basis import fix_signs, numerical_rank, pod, thin_qr
from strategies import SEEDS

SHAPES = st.tuples(st.integers(1, 60), st.integers(1, 12), SEEDS)


def matrix_of(shape: tuple[int, int, int]) -> np.ndarray:
    """Random matrix (n, m) with columns of very different size."""
    n, m, seed = shape
    rng = np.random.default_rng(seed)
    return rng.standard_normal((n, m)) * 10.0 ** rng.uniform(-6, 6, m)


@given(SHAPES)
def test_modes_and_singular_values_are_those_of_a_dense_svd(shape):
    """Modes are orthonormal and span the columns, with positive largest entries; input is kept."""
    matrix = matrix_of(shape)
    before = matrix.copy()
    u, sigma = pod(matrix)
    np.testing.assert_array_equal(matrix, before)
    assert u.shape == (matrix.shape[0], min(matrix.shape))
    assert np.abs(u.T @ u - np.eye(u.shape[1])).max() < 1e-13
    reference = np.linalg.svd(matrix, compute_uv=False)
    np.testing.assert_allclose(sigma, reference, rtol=0.0, atol=1e-14 * reference[0])
    assert np.abs(u @ (u.T @ matrix) - matrix).max() <= 1e-13 * np.abs(matrix).max()
    assert (u.max(axis=0) >= np.abs(u).max(axis=0) * (1.0 - 1e-6)).all()


def test_small_singular_values_survive_where_the_gram_matrix_loses_them(rng):
    """sigma_8 = 1e-13 sigma_1: below sqrt(eps), so that A^T A cannot hold it."""
    q = np.linalg.qr(rng.standard_normal((500, 8)))[0]
    w = np.linalg.qr(rng.standard_normal((8, 8)))[0]
    wanted = np.logspace(0, -13, 8)
    np.testing.assert_allclose(pod(q * wanted @ w.T)[1], wanted, rtol=1e-2)


def test_modes_and_singular_values_are_those_of_pymor(rng):
    matrix = rng.standard_normal((200, 12)) * np.logspace(0, -3, 12)
    modes, sigma = pymor_pod(NumpyVectorSpace(200).from_numpy(matrix), method="qr_svd", rtol=0.0)
    u, ours = pod(matrix)
    np.testing.assert_allclose(ours, sigma, rtol=1e-11)
    np.testing.assert_allclose(u, fix_signs(modes.to_numpy()), atol=1e-9)


def test_the_first_of_equally_large_entries_determines_the_sign():
    u = np.array([[-0.5, 0.5], [0.5 * (1.0 + 1e-12), -0.5 * (1.0 + 1e-12)]])
    np.testing.assert_array_equal(fix_signs(u), u * [-1.0, 1.0])
    for shape in ((7, 0), (0, 0)):
        assert fix_signs(np.empty(shape)).shape == shape


@given(SHAPES, SEEDS)
def test_signs_of_modes_do_not_depend_on_signs_of_the_input(shape, seed):
    matrix = matrix_of(shape)
    flips = np.random.default_rng(seed).choice([-1.0, 1.0], matrix.shape[1])
    np.testing.assert_array_equal(fix_signs(matrix), fix_signs(matrix * flips))


EPS = np.finfo(float).eps


@pytest.mark.parametrize(
    ("sigma", "shape", "roundoff", "rank"),
    [
        ([], (10, 0), 0.0, 0),
        ([0.0, 0.0], (10, 2), 0.0, 0),
        ([3.0, 2.0, 1.0], (10, 3), 0.0, 3),
        ([3.0, 2.0, 1.0], (10, 3), 1.5, 2),
        ([3.0, 2.0, 1.0], (10, 3), 5.0, 0),
        # a value equal to a level is not above it
        ([3.0, 2.0, 1.0], (10, 3), 2.0, 1),
        ([1.0, 11 * EPS, 9 * EPS], (10, 3), 0.0, 2),
        ([1.0, 11 * EPS, 9 * EPS], (3, 10), 0.0, 2),
        ([1.0, 11 * EPS, 9 * EPS], (8, 8), 0.0, 3),
    ],
)
def test_the_numerical_rank_counts_singular_values_above_both_levels(sigma, shape, roundoff, rank):
    assert numerical_rank(np.array(sigma), shape, roundoff) == rank


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


@given(SHAPES, st.sampled_from([1e-290, 1.0, 1e140]))
def test_qr_gives_orthonormal_columns_whose_product_is_the_matrix(shape, scale):
    """The matrix is tall, its columns have very different sizes, and the last one is dependent."""
    n, m, seed = shape
    matrix = matrix_of((n + m, m, seed))
    matrix[:, -1] = matrix[:, :-1].sum(axis=1)
    check(scale * matrix)


@pytest.mark.parametrize("m", [30, 70])
def test_an_ill_conditioned_factor_is_detected(m, monkeypatch):
    """For m = 70 the first Cholesky factorisation fails; for 30 the loss of orthogonality is seen.

    LU with partial pivoting leaves L = -1 below the diagonal, of condition m 2^(m-1).
    """
    calls = []
    reflect = module._by_reflections

    def counted(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        calls.append(matrix.shape)
        return reflect(matrix)

    monkeypatch.setattr(module, "_by_reflections", counted)
    check(np.vstack([np.eye(m) - np.tril(np.ones((m, m)), -1), np.zeros((3, m))]))
    assert calls == [(m + 3, m)]
