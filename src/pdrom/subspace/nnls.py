"""Sparse non-negative least squares, stopped early (Lawson and Hanson 1974; Farhat et al. 2014)."""

import logging

import numpy as np
from scipy import linalg

log = logging.getLogger(__name__)

# A column whose part outside the active span is below this fraction of it adds nothing.
DEPENDENT = 1e-7


def nnls_early_stop(
    g: np.ndarray, b: np.ndarray, tolerance: float, most: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Non-negative x with || G x - b || <= tolerance || b ||, few entries positive.

    The active-set method of Lawson and Hanson: the column with the largest correlation joins, the
    least-squares problem of the active columns is solved, columns that would turn negative leave.
    It ends at the tolerance, so that the support stays small; for tolerance 0 it is plain NNLS. The
    normal equations of the active columns grow by one row of a Cholesky factor a step; with
    columns scaled to length one their accuracy suffices for tolerances down to about 1e-6.

    Parameters
    ----------
    g : (m, e) columns, one per element
    b : (m,)
    most : largest support; default min(m, e)

    Returns
    -------
    support, values
        Indices of the positive entries, ascending (n,), and their values (n,).
    """
    norms = np.linalg.norm(g, axis=0)
    scaled = g / np.where(norms > 0.0, norms, 1.0)
    most = min(g.shape) if most is None else min(most, *g.shape)
    state = _ActiveSet(scaled, b, most)
    size = float(np.linalg.norm(b))
    banned = norms == 0.0
    residual = b.copy()
    while np.linalg.norm(residual) > tolerance * size and len(state.active) < most:
        gradient = scaled.T @ residual
        gradient[state.active] = -np.inf
        gradient[banned] = -np.inf
        new = int(np.argmax(gradient))
        if gradient[new] <= 1e-12 * size:
            break
        if state.add(new):
            state.solve()
        # a column that depends on the others, or left at once, would be picked for ever
        if new not in state.active:
            banned[new] = True
        residual = state.residual
    error = np.linalg.norm(residual) / size if size else 0.0
    log.info("NNLS: %d of %d columns, residual %.2e", len(state.active), g.shape[1], error)
    support = np.argsort(state.active)
    active = np.array(state.active, dtype=np.int64)[support]
    return active, state.values[support] / norms[active]


class _ActiveSet:
    """Active columns, their values, and the Cholesky factor of their Gram matrix."""

    def __init__(self, g: np.ndarray, b: np.ndarray, most: int) -> None:
        self._g, self._b = g, b
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
        n, new = len(self.active), self._g[:, column]
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
            keep = x > 1e-14 * max(float(np.abs(x).max()), np.finfo(float).tiny)
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
        """Leave the columns of ``keep`` only, with values ``x``."""
        kept = np.flatnonzero(keep)
        n = len(kept)
        self._columns[:, :n] = self._columns[:, kept]
        self._target[:n] = self._target[kept]
        self.active = [self.active[i] for i in kept]
        self.values = x[kept]
        if n:
            columns = self._columns[:, :n]
            self._factor[:n, :n] = linalg.cholesky(columns.T @ columns, lower=True)
