"""Interface of all rules that select samples; greedy discrete empirical interpolation (DEIM).

DEIM (Chaturantabut and Sorensen 2010, algorithm 1) selects single entries or elements (all 3p
entries of an element of p rows). The preprint's variant selects rows of three entries (x, y, z), by
the residual norm over the three axes.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from scipy import linalg

from pdrom.reduction.sampling.gappy_pod_e import oversample


class Selection(ABC):
    """A rule that selects blocks of rows of a basis: entries (blocks of one row) or elements.

    Subclasses are listed by name in `pdrom.reduction.method`.
    """

    @abstractmethod
    def one_a_mode(self, v: np.ndarray, size: int, ranks: Sequence[int]) -> dict[int, np.ndarray]:
        """Select r distinct blocks (all, if fewer exist) for each number r of modes in ``ranks``.

        ``v`` (size e, R) has R modes, at least the largest of ``ranks``, and ``size`` consecutive
        rows for each of e blocks.
        """

    def extend(self, v: np.ndarray, size: int, chosen: np.ndarray, count: int) -> np.ndarray:
        """Extend the ``chosen`` blocks (m,) of ``v`` (size e, r) to ``count``, by GappyPOD+E."""
        return oversample(v, size, chosen, count)


# Of residual entries that differ by less than this fraction, `tie_weights` may favour the first.
TIE = 1e-6


def deim_entries(v: np.ndarray) -> np.ndarray:
    """Select min(n, r) DEIM entries of the basis ``v`` (n, r); k modes use the first k.

    The entry where the residual v_k - V_{k-1} (P^T V_{k-1})^-1 P^T v_k, times the weights w of
    `tie_weights`, is largest follows the k - 1 earlier ones, which P^T selects. These are the
    pivots of an LU factorisation of diag(w) V with partial pivoting (Sorensen and Embree 2016,
    section 3), which LAPACK does in blocks. The entries are distinct, also for dependent modes.
    """
    n, r = v.shape
    weighted = np.multiply(v, tie_weights(n)[:, None], out=np.empty((n, r), order="F"))
    _, swaps, _ = linalg.lapack.dgetrf(weighted, overwrite_a=True)
    order = np.arange(n)
    for k, swap in enumerate(swaps):
        order[k], order[swap] = order[swap], order[k]
    return order[: len(swaps)]


def tie_weights(n: int) -> np.ndarray:
    """Return factors (n,), falling from 1 to almost 1 - TIE, that break ties of n magnitudes.

    In a symmetric trajectory, residuals are equal up to rounding errors. Times the factors, the
    first is largest: a residual d places later is selected only if larger by the part TIE d / n.
    """
    return 1.0 - TIE * np.arange(n) / n


BLOCK = 16  # number of columns that LAPACK eliminates at a time


class GrowingFit:
    """Least-squares fit of each mode by the earlier modes at a growing set of sampled rows.

    The coefficients c of mode v_k in the earlier modes V_k solve (S V_k) c = S v_k; S selects rows.
    The triangular QR factor R (r, r) of the sampled rows of all modes is updated when s rows are
    added, at a cost O(s r^2). R[:k, :k] c = R[:k, k] has the same least-squares solutions.
    """

    def __init__(self, modes: int) -> None:
        self._factor = np.zeros((modes, modes), order="F")

    def add(self, rows: np.ndarray) -> None:
        """Add s sampled rows to the fit; ``rows`` (s, r) are the entries of the r modes in them."""
        block = min(BLOCK, len(self._factor))
        self._factor = linalg.lapack.dtpqrt(0, block, self._factor, rows, overwrite_a=True)[0]

    def triangle(self, k: int) -> np.ndarray:
        """Return the factor R (k, k) of k modes; R^T R is the Gram matrix of their sampled rows."""
        return self._factor[:k, :k]

    def coefficients(self, k: int) -> np.ndarray:
        """Fit mode k at the sampled rows by modes 0 to k - 1; coefficients (k,) of least norm."""
        factor, target = self.triangle(k), self._factor[:k, k]
        if linalg.lapack.dtrcon(factor)[0] > k * np.finfo(float).eps:
            return linalg.solve_triangular(factor, target, check_finite=False)
        return np.linalg.lstsq(factor, target, rcond=None)[0]


def block_elements(v: np.ndarray, size: int) -> np.ndarray:
    """Select min(e, r) elements of a basis ``v`` (size e, r) by DEIM; k modes use the first k.

    Each of the e elements has ``size`` rows. Mode k is fitted by the earlier modes on the rows of
    the elements selected so far; the element with the largest residual norm is selected next.
    """
    total = len(v) // size
    return _greedy([v], total, min(total, v.shape[1]), repeat=False)


def joint_rows(v: np.ndarray, active: tuple[bool, ...], repeat: bool) -> np.ndarray:
    """Select rows (x, y, z) of a basis ``v`` (3 rows, r) for r modes; k modes use the first k.

    For mode k each axis a has a separate system (P^T V_a) c_a = P^T v_{k,a}; P^T selects rows.
    An axis without modes, False in ``active``, is left out. The row with the largest sum of squared
    residuals is selected for all axes. It may be useless for one axis, whose system is then solved
    in the least-squares sense. With ``repeat`` a row may be selected again, as in the program of
    the preprint's authors; without it, there are at most as many entries as the basis has rows.
    """
    rows, r = len(v) // 3, v.shape[1]
    axes = [v[a::3] for a in np.flatnonzero(active)]
    return _greedy(axes, rows, r if repeat else min(rows, r), repeat)


def _greedy(parts: Sequence[np.ndarray], total: int, count: int, repeat: bool) -> np.ndarray:
    """Select ``count`` of ``total`` blocks of rows, each by the largest residual of the next mode.

    ``parts`` is the matrix of the modes, or one per axis. Each is fitted separately; their squared
    residuals, times squared `tie_weights`, are added. With ``repeat`` a block may be repeated.
    """
    fits = [(np.asfortranarray(part), GrowingFit(part.shape[1])) for part in parts]
    weights = tie_weights(total) ** 2
    picked = np.empty(count, dtype=np.int64)
    for k in range(count):
        norm = np.zeros(total)
        for modes, fit in fits:
            residual = modes[:, k] - modes[:, :k] @ fit.coefficients(k) if k else modes[:, k]
            norm += np.square(residual).reshape(total, -1).sum(axis=1)
        norm *= weights
        if not repeat:
            norm[picked[:k]] = -1.0
        picked[k] = block = int(np.argmax(norm))
        for modes, fit in fits:
            size = len(modes) // total
            fit.add(modes[size * block : size * (block + 1)])
    return picked
