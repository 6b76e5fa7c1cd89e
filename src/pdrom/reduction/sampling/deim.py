"""Discrete empirical interpolation (Chaturantabut and Sorensen 2010, algorithm 1)."""

import numpy as np
from scipy import linalg

# Residuals of one size up to a little more than round-off are a tie, see `tie_weights`.
TIE = 1e-6


def deim_entries(v: np.ndarray) -> np.ndarray:
    """Greedy interpolation entries of the basis ``v`` (n, r), min(n, r) of them, nested in r.

    The k-th residual v_k - V_{k-1} (P^T V_{k-1})^-1 P^T v_k vanishes at all earlier entries; the
    entry where its magnitude, times `tie_weights`, is largest comes next. These are the pivots of
    an LU factorisation of diag(w) V with partial pivoting (Sorensen and Embree 2016, section 3),
    which LAPACK does in blocks. Scaling rows scales the residuals and changes nothing else.

    The entries are distinct whatever V holds. Of a mode that depends on the earlier ones nothing
    but round-off is left, and its entry means nothing.
    """
    n, r = v.shape
    weighted = np.multiply(v, tie_weights(n)[:, None], out=np.empty((n, r), order="F"))
    _, swaps, _ = linalg.lapack.dgetrf(weighted, overwrite_a=True)
    order = np.arange(n)
    for k, swap in enumerate(swaps):
        order[k], order[swap] = order[swap], order[k]
    return order[: len(swaps)]


def tie_weights(n: int) -> np.ndarray:
    """Factors (n,) from 1 falling to almost 1 - TIE, by which n magnitudes are multiplied.

    A motion that is symmetric has residuals that are equal up to round-off, and which of them is
    largest would depend on the order of the operations. With the factors the first one is taken:
    one that stands d entries later wins if it is larger by more than TIE d / n of its size.
    """
    return 1.0 - TIE * np.arange(n) / n
