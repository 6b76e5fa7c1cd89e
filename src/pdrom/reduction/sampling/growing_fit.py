"""Least squares whose equations and unknowns grow together: each mode fitted by those before it."""

import numpy as np
from scipy import linalg

BLOCK = 16  # columns that LAPACK eliminates at a time


class GrowingFit:
    """Coefficients of a mode in the earlier modes at sampled rows, (S V_k) c = S v_k.

    Kept is the triangular factor R (r, r) of the sampled rows of all modes, into which further rows
    are rotated: of the first k + 1 columns, R[:k, :k] c = R[:k, k] has the same least-squares
    solutions as the equations themselves. That takes O(s r^2) for s rows, where a factorisation of
    all rows takes O(m k^2).
    """

    def __init__(self, modes: int) -> None:
        self._factor = np.zeros((modes, modes), order="F")

    def add(self, rows: np.ndarray) -> None:
        """Sample ``rows`` (s, r) of the modes."""
        block = min(BLOCK, len(self._factor))
        self._factor = linalg.lapack.dtpqrt(0, block, self._factor, rows, overwrite_a=True)[0]

    def triangle(self, k: int) -> np.ndarray:
        """R (k, k) of the first k modes: R^T R is the Gram matrix of their sampled rows."""
        return self._factor[:k, :k]

    def coefficients(self, k: int) -> np.ndarray:
        """c (k,) of mode k; of several solutions, up to round-off, the shortest."""
        factor, target = self.triangle(k), self._factor[:k, k]
        if linalg.lapack.dtrcon(factor)[0] > k * np.finfo(float).eps:
            return linalg.solve_triangular(factor, target, check_finite=False)
        return np.linalg.lstsq(factor, target, rcond=None)[0]
