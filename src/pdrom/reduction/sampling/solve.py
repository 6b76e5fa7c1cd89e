"""Solution operators of the sampled equations A c = b, A of shape (m, r)."""

import numpy as np
from scipy import linalg

from pdrom.reduction.method import Solve


def solution_operator(a: np.ndarray, solve: Solve, tikhonov: float) -> np.ndarray:
    """Matrix (r, m) that maps values b sampled by ``a`` (m, r) to coefficients c, by ``solve``.

    square : A^-1; nan where A is singular to working precision or not square: the interpolation
        does not exist, a run with it ends in its first frame
    qr : least squares A^+ by a QR factorisation; nan where A has no full column rank
    tikhonov : (A^T A + t I)^-1 A^T, the normal equations of the published code
    """
    if solve == "tikhonov":
        gram = a.T @ a + tikhonov * np.eye(a.shape[1])
        return linalg.solve(gram, a.T, assume_a="pos", check_finite=False)
    if solve == "square":
        return _inverse(a)
    q, r = linalg.qr(a, mode="economic", check_finite=False)
    if a.shape[0] < a.shape[1] or _singular(np.abs(np.diag(r))):
        return np.full((a.shape[1], a.shape[0]), np.nan)
    return linalg.solve_triangular(r, q.T, check_finite=False)


def _inverse(a: np.ndarray) -> np.ndarray:
    if a.shape[0] != a.shape[1]:
        return np.full(a.shape[::-1], np.nan)
    lu, pivots, info = linalg.lapack.dgetrf(a)
    if info > 0 or _singular(np.abs(np.diag(lu))):
        return np.full(a.shape, np.nan)
    return linalg.lu_solve((lu, pivots), np.eye(len(a)), check_finite=False)


def _singular(diagonal: np.ndarray) -> bool:
    """A factor's diagonal with a zero, or with one that is round-off of the largest."""
    return bool(diagonal.min() <= np.finfo(float).eps * diagonal.max())


def norm_and_condition(a: np.ndarray, operator: np.ndarray) -> tuple[float, float]:
    """2-norm of ``operator`` (the gain) and condition number of ``a`` (m, r); inf if singular."""
    if not np.isfinite(operator).all():
        return np.inf, np.inf
    sigma = linalg.svdvals(a, check_finite=False)
    condition = float(sigma[0] / sigma[-1]) if sigma[-1] > 0.0 else np.inf
    return float(linalg.svdvals(operator, check_finite=False)[0]), condition
