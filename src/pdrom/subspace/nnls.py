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
    state = _ActiveSet(scaled, b)
    most = min(g.shape) if most is None else min(most, *g.shape)
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
        residual = b - scaled[:, state.active] @ state.values
    error = np.linalg.norm(residual) / size if size else 0.0
    log.info("NNLS: %d of %d columns, residual %.2e", len(state.active), g.shape[1], error)
    support = np.argsort(state.active)
    active = np.array(state.active, dtype=np.int64)[support]
    return active, state.values[support] / norms[active]


class _ActiveSet:
    """Active columns, their values, and the Cholesky factor of their Gram matrix."""

    def __init__(self, g: np.ndarray, b: np.ndarray) -> None:
        self._g, self._b = g, b
        self.active: list[int] = []
        self.values = np.zeros(0)
        self._factor = np.zeros((0, 0))

    def add(self, column: int) -> bool:
        """Append a column; False (and nothing happens) if it depends on the active ones."""
        new = self._g[:, column]
        n = len(self.active)
        cross = linalg.solve_triangular(
            self._factor, self._g[:, self.active].T @ new, lower=True, check_finite=False
        ) if n else np.zeros(0)  # fmt: skip
        rest = float(new @ new - cross @ cross)
        if rest <= DEPENDENT**2:
            return False
        factor = np.zeros((n + 1, n + 1))
        factor[:n, :n], factor[n, :n], factor[n, n] = self._factor, cross, np.sqrt(rest)
        self._factor = factor
        self.active.append(column)
        self.values = np.append(self.values, 0.0)
        return True

    def solve(self) -> None:
        """Least squares on the active columns; columns that turn negative are taken out."""
        while self.active:
            target = self._g[:, self.active].T @ self._b
            z = linalg.cho_solve((self._factor, True), target, check_finite=False)
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
            self.active = [a for a, k in zip(self.active, keep, strict=True) if k]
            self.values = x[keep]
            columns = self._g[:, self.active]
            self._factor = linalg.cholesky(columns.T @ columns, lower=True) if self.active else (
                np.zeros((0, 0))
            )  # fmt: skip
