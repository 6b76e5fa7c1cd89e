"""Q-DEIM: entries by a column-pivoted QR factorisation (Drmac and Gugercin 2016)."""

import numpy as np
from scipy import linalg


def qdeim_entries(v: np.ndarray) -> np.ndarray:
    """The first r pivots of the pivoted QR factorisation of ``v``^T, v of shape (n, r)."""
    pivots = linalg.qr(v.T, mode="r", pivoting=True, check_finite=False)[1]
    return pivots[: v.shape[1]].astype(np.int64)
