"""Sparse non-negative least squares, stopped early (Lawson and Hanson 1974; Farhat et al. 2014)."""

import logging

import numpy as np
from scipy import linalg

log = logging.getLogger(__name__)


def nnls_early_stop(
    g: np.ndarray, b: np.ndarray, tolerance: float, most: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Non-negative x with || G x - b || <= tolerance || b ||, few entries positive.

    The active-set method of Lawson and Hanson: the column with the largest correlation joins, the
    least-squares problem of the active columns is solved, columns that would turn negative leave.
    It ends at the tolerance, so that the support stays small; for tolerance 0 it is plain NNLS.

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
    most = min(g.shape) if most is None else most
    active: list[int] = []
    x = np.zeros(0)
    banned = np.zeros(g.shape[1], dtype=bool)
    residual, target = b.copy(), tolerance * float(np.linalg.norm(b))
    smallest = np.finfo(float).eps * np.linalg.norm(g, axis=0) * np.linalg.norm(b) * 10.0
    while np.linalg.norm(residual) > target and len(active) < most:
        gradient = g.T @ residual
        gradient[active] = -np.inf
        gradient[banned] = -np.inf
        new = int(np.argmax(gradient))
        if gradient[new] <= smallest[new]:
            break
        before = set(active)
        active, x = _solve(g, b, [*active, new], np.append(x, 0.0))
        residual = b - g[:, active] @ x
        # a column that left at once would be picked for ever
        banned[:] = False
        if new not in active and set(active) == before:
            banned[new] = True
    support = np.argsort(active)
    log.info("NNLS: %d of %d columns, residual %.2e", len(active), g.shape[1],
             np.linalg.norm(residual) / max(np.linalg.norm(b), np.finfo(float).tiny))  # fmt: skip
    return np.array(active, dtype=np.int64)[support], x[support]


def _solve(
    g: np.ndarray, b: np.ndarray, active: list[int], x: np.ndarray
) -> tuple[list[int], np.ndarray]:
    """Least squares on the active columns, with the columns that turn negative taken out."""
    while active:
        q, r = linalg.qr(g[:, active], mode="economic", check_finite=False)
        diagonal = np.abs(np.diag(r))
        if diagonal[-1] <= 1e-12 * diagonal.max():
            # the newest column depends on the others
            active, x = active[:-1], x[:-1]
            continue
        z = linalg.solve_triangular(r, q.T @ b, check_finite=False)
        if (z > 0.0).all():
            return active, z
        negative = z <= 0.0
        step = np.min(x[negative] / (x[negative] - z[negative]))
        x = x + step * (z - x)
        keep = x > 1e-14 * max(float(np.abs(x).max()), np.finfo(float).tiny)
        if keep.all():
            keep[np.argmin(np.where(negative, x, np.inf))] = False
        active = [a for a, k in zip(active, keep, strict=True) if k]
        x = x[keep]
    return active, x
