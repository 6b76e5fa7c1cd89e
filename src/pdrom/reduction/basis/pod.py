"""Proper orthogonal decomposition of tall matrices, with fixed signs."""

import numpy as np
from scipy import linalg

from pdrom.reduction.basis.thin_qr import thin_qr


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
