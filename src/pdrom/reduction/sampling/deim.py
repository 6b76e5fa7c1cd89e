"""Discrete empirical interpolation (Chaturantabut and Sorensen 2010, algorithm 1)."""

import numpy as np


def deim_entries(v: np.ndarray) -> np.ndarray:
    """Greedy interpolation entries (r,) of the basis ``v`` (n, r), nested in r.

    The k-th residual v_k - V_{k-1} (P^T V_{k-1})^-1 P^T v_k vanishes at all earlier entries.
    Expressed in the earlier residuals instead of the earlier modes, the small systems are unit
    lower triangular and grow by one row a step: O(n r^2) in all.
    """
    n, r = v.shape
    residuals = np.empty((n, r), order="F")
    entries = np.empty(r, dtype=np.int64)
    for k in range(r):
        residual = v[:, k].copy()
        # forward substitution with the triangular matrix residuals[entries[:k], :k]
        for j in range(k):
            residual -= residuals[:, j] * (residual[entries[j]] / residuals[entries[j], j])
        residual[entries[:k]] = 0.0
        entries[k] = np.argmax(np.abs(residual))
        residuals[:, k] = residual
    return entries
