"""Sparse non-negative least squares, stopped early (Lawson and Hanson 1974; Farhat et al. 2014)."""

import logging
from collections.abc import Sequence

import numpy as np
from numba import njit
from scipy import linalg

log = logging.getLogger(__name__)

# A column whose part outside the active span is below this fraction of it adds nothing.
DEPENDENT = 1e-7

# Columns that join together: those within CLOSE of the best one, at most this share of the active.
CLOSE = 0.7
BLOCK = 0.2


def nnls_path(
    g: np.ndarray, b: np.ndarray, tolerances: Sequence[float]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Non-negative x with || G x - b || <= tolerance || b || for each of several tolerances.

    The active-set method of Lawson and Hanson: the columns with the largest correlation join, the
    least-squares problem of the active columns is solved, columns that would turn negative leave.
    The search passes the tolerances from the coarsest to the finest and notes each solution, so
    that the supports stay small. Where many columns are active a few join at a time, which saves
    passes over G; when none of a block stays, the next column comes alone, as in the original
    method, whose end is the minimum. The normal equations of the active columns grow by rows of a
    Cholesky factor; with columns scaled to length one their accuracy suffices for tolerances down
    to about 1e-6. Beside G, no array is larger than G's active columns.

    Parameters
    ----------
    g : (m, e) columns, one per element; in Fortran order a pass reads memory in order
    b : (m,)
    tolerances : relative residuals; for 0 it is plain NNLS

    Returns
    -------
    For each tolerance, in the order given: support, the indices of the positive entries, ascending
    (n,), and their values (n,). Where a tolerance cannot be reached it is the best x found.
    """
    norms = np.linalg.norm(g, axis=0)
    search = _Search(g, norms, b)
    found: dict[float, tuple[np.ndarray, np.ndarray]] = {}
    for tolerance in sorted(set(tolerances), reverse=True):
        search.reach(tolerance)
        found[tolerance] = search.solution()
        missed = search.relative_residual > tolerance > 0.0
        log.log(
            logging.WARNING if missed else logging.INFO,
            "NNLS: %d of %d columns, residual %.2e%s",
            len(found[tolerance][0]), g.shape[1], search.relative_residual,
            f", which misses the tolerance {tolerance:g}" if missed else "",
        )  # fmt: skip
    return [found[tolerance] for tolerance in tolerances]


class _Search:
    """The outer loop: which columns join."""

    def __init__(self, g: np.ndarray, norms: np.ndarray, b: np.ndarray) -> None:
        self._g, self._norms, self._most = g, norms, min(g.shape)
        self._size = float(np.linalg.norm(b))
        self._state = _ActiveSet(g, norms, b, self._most)
        self._banned = norms == 0.0
        self._safe = np.where(self._banned, 1.0, norms)
        self._alone = False

    @property
    def relative_residual(self) -> float:
        """|| G x - b || / || b ||."""
        return float(np.linalg.norm(self._state.residual)) / self._size if self._size else 0.0

    def solution(self) -> tuple[np.ndarray, np.ndarray]:
        """Support, ascending, and values."""
        order = np.argsort(self._state.active)
        active = np.array(self._state.active, dtype=np.int64)[order]
        return active, self._state.values[order] / self._norms[active]

    def reach(self, tolerance: float) -> None:
        """Add columns until the tolerance is met, the support is full, or nothing helps."""
        while self.relative_residual > tolerance and len(self._state.active) < self._most:
            block = self._choose()
            if len(block) == 0:
                return
            joined = [int(c) for c in block if self._state.add(int(c))]
            if joined:
                self._state.solve()
            staying = set(self._state.active).intersection(joined)
            # a column that depends on the others, or left at once, would be picked for ever
            if len(block) == 1 and not staying:
                self._banned[block] = True
            self._alone = not staying and len(block) > 1

    def _choose(self) -> np.ndarray:
        """Columns of the largest correlation with the residual, the best one first."""
        gradient = (self._state.residual @ self._g) / self._safe
        gradient[self._state.active] = -np.inf
        gradient[self._banned] = -np.inf
        best = float(gradient.max())
        if not best > 1e-12 * self._size:
            return np.empty(0, dtype=np.int64)
        room = self._most - len(self._state.active)
        count = 1 if self._alone else min(room, 1 + int(BLOCK * len(self._state.active)))
        if count == 1:
            return np.array([np.argmax(gradient)])
        first = np.argpartition(-gradient, min(count, len(gradient) - 1))[:count]
        first = first[gradient[first] >= CLOSE * best]
        return first[np.argsort(-gradient[first], kind="stable")]


class _ActiveSet:
    """Active columns, their values, and the Cholesky factor of their Gram matrix."""

    def __init__(self, g: np.ndarray, norms: np.ndarray, b: np.ndarray, most: int) -> None:
        self._g, self._norms, self._b = g, norms, b
        self._columns = np.empty((len(b), most), order="F")
        self._factor = np.zeros((most, most), order="F")
        self._target = np.empty(most)
        self.active: list[int] = []
        self.values = np.zeros(0)

    @property
    def residual(self) -> np.ndarray:
        """b - G x."""
        return self._b - self._columns[:, : len(self.active)] @ self.values

    def add(self, column: int) -> bool:
        """Append a column; False (and nothing happens) if it depends on the active ones."""
        n, new = len(self.active), self._g[:, column] / self._norms[column]
        cross = self._forward(self._columns[:, :n].T @ new)
        rest = float(new @ new - cross @ cross)
        if rest <= DEPENDENT**2:
            return False
        self._columns[:, n] = new
        self._factor[n, :n], self._factor[n, n] = cross, np.sqrt(rest)
        self._target[n] = new @ self._b
        self.active.append(column)
        self.values = np.append(self.values, 0.0)
        return True

    def solve(self) -> None:
        """Least squares on the active columns; columns that turn negative are taken out."""
        while self.active:
            z = self._least_squares()
            if (z > 0.0).all():
                self.values = z
                return
            negative = z <= 0.0
            x = self.values
            step = np.min(x[negative] / (x[negative] - z[negative]))
            x = x + step * (z - x)
            keep = ~negative | (x > 1e-14 * max(float(np.abs(x).max()), np.finfo(float).tiny))
            if keep.all():
                keep[np.argmin(np.where(negative, x, np.inf))] = False
            self._keep(keep, x)

    def _least_squares(self) -> np.ndarray:
        n = len(self.active)
        half = self._forward(self._target[:n])
        factor = self._factor[:n, :n]
        return linalg.solve_triangular(factor, half, lower=True, trans="T", check_finite=False)

    def _forward(self, rhs: np.ndarray) -> np.ndarray:
        n = len(rhs)
        if n == 0:
            return rhs
        return linalg.solve_triangular(self._factor[:n, :n], rhs, lower=True, check_finite=False)

    def _keep(self, keep: np.ndarray, x: np.ndarray) -> None:
        """Keep only the columns of ``keep``, with values ``x``."""
        kept = np.flatnonzero(keep)
        size, n = len(self.active), len(kept)
        first = int(np.flatnonzero(~keep)[0])
        self._columns[:, first:n] = self._columns[:, kept[first:]]
        self._target[:n] = self._target[kept]
        self.active = [self.active[i] for i in kept]
        self.values = x[kept]
        for column in np.flatnonzero(~keep)[::-1]:
            _remove_row(self._factor, size, int(column))
            size -= 1


@njit(cache=True, error_model="numpy")
def _remove_row(factor, n, column):
    """Take row and column ``column`` out of the matrix whose Cholesky factor (n, n) is given.

    The rows below move up, and the rest of their factor takes the lost column in as a rank-one
    update (Gill, Golub, Murray, Saunders 1974, method C1).
    """
    lost = factor[column + 1 : n, column].copy()
    for j in range(column, n - 1):
        for i in range(j, n - 1):
            factor[i, j] = factor[i + 1, j + 1]
    for j in range(column):
        for i in range(column, n - 1):
            factor[i, j] = factor[i + 1, j]
    for j in range(column, n - 1):
        v = lost[j - column]
        diagonal = factor[j, j]
        radius = np.sqrt(diagonal * diagonal + v * v)
        c, s = radius / diagonal, v / diagonal
        factor[j, j] = radius
        for i in range(j + 1, n - 1):
            value = (factor[i, j] + s * lost[i - column]) / c
            lost[i - column] = c * lost[i - column] - s * value
            factor[i, j] = value
