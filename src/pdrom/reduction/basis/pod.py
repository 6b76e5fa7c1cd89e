"""Proper orthogonal decomposition of tall matrices, with fixed signs."""

import numpy as np
from scipy import linalg


def pod(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left singular vectors (n, m) and singular values (m,) of ``matrix`` (n, m), n >= m or not.

    A tall matrix is first reduced by a QR factorisation, A = Q R, and R is decomposed: backward
    stable like the SVD of A itself (Chan 1982), unlike the eigenvalues of A^T A, which lose all
    singular values below sqrt(eps) sigma_1. Each vector's entry of largest magnitude is positive.
    """
    if matrix.shape[0] > matrix.shape[1]:
        q, second, r = thin_qr(matrix)
        u, sigma, _ = linalg.svd(r, full_matrices=False, check_finite=False)
        u = (linalg.solve_triangular(second, u, check_finite=False).T @ q.T).T
    else:
        u, sigma, _ = linalg.svd(matrix, full_matrices=False, check_finite=False)
    return fix_signs(u), sigma


def fix_signs(u: np.ndarray) -> np.ndarray:
    """Columns of ``u`` (n, m) with their entry of largest magnitude made positive.

    Magnitudes are compared after rounding to single precision, so that entries which are equal up
    to round-off tie and the first of them decides.
    """
    if u.shape[1] == 0:
        return u
    largest = [np.argmax(np.abs(mode).astype(np.float32)) for mode in u.T]
    signs = np.sign(u[largest, np.arange(u.shape[1])])
    return u * np.where(signs == 0.0, 1.0, signs)


# Largest |Q_1^T Q_1 - I| that counts as good: round-off leaves 1e-14 to 1e-13, a factor L of
# condition 1e2 about 1e-12.
DEPARTURE = 1e-12


def thin_qr(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Q_1 (n, m), R_2 (m, m) and R (m, m) of A = ``matrix`` (n, m), n > m: A = (Q_1 R_2^-1) R.

    Q_1 R_2^-1 has orthonormal columns up to round-off, also where A has no full rank. It is not
    formed: what comes next multiplies it by something, and that is better done to R_2^-1 first.

    Householder's reflections go through A once a column and wait for memory. Here (Terao, Ozaki and
    Ogita 2020) LU with partial pivoting, A = P L U, leaves a well-conditioned L, and two Cholesky
    factorisations of Gram matrices make it orthonormal: L = Q_1 R_1, Q_1 = Q R_2, R = R_2 R_1 U.
    That L is well-conditioned is no theorem: where Q_1 is not orthonormal up to `DEPARTURE`,
    reflections do it. Where it is, the error of R is that of the LU factorisation, some eps cond(L)
    of each column of A.
    """
    lower, swaps, _ = linalg.lapack.dgetrf(np.array(matrix, order="F"), overwrite_a=True)
    m = matrix.shape[1]
    upper = np.triu(lower[:m])
    lower[:m] = np.tril(lower[:m], -1) + np.eye(m)
    try:
        first = linalg.cholesky(lower.T @ lower, check_finite=False)
    except linalg.LinAlgError:
        return _by_reflections(matrix)
    q = linalg.blas.dtrsm(1.0, first, lower, side=1, overwrite_b=True)
    gram = q.T @ q
    if not np.abs(gram - np.eye(m)).max() <= DEPARTURE:
        return _by_reflections(matrix)
    second = linalg.cholesky(gram, check_finite=False)
    for k in reversed(range(m)):
        q[[k, swaps[k]]] = q[[swaps[k], k]]
    return q, second, second @ (first @ upper)


def _by_reflections(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q, r = linalg.qr(matrix, mode="economic", check_finite=False)
    return q, np.eye(len(r)), r


def numerical_rank(singular_values: np.ndarray, shape: tuple[int, int], roundoff: float) -> int:
    """Number of ``singular_values`` (n,) of a matrix of that ``shape`` above both round-off levels.

    The relative level max(shape) eps sigma_1 is the backward error of the SVD. The absolute level
    ``roundoff`` is the error of the data themselves: where a projection is the difference of
    cancelling terms, all of its singular values may be noise although they decay nicely.
    """
    if len(singular_values) == 0:
        return 0
    relative = max(shape) * np.finfo(float).eps * singular_values[0]
    return int(np.count_nonzero(singular_values > max(relative, roundoff)))
