"""Residuals of the DEIM iterations, recomputed from a basis and the samples that were picked."""

from dataclasses import dataclass

import numpy as np

from pdrom.core.errors import StorageError


@dataclass(frozen=True)
class Iteration:
    """Step k of a greedy selection.

    magnitude : (e,) on each element the residual of mode k in the measure that the selection
        takes the largest of: its largest entry (``rows`` "scalar"), the largest norm of one of its
        rows over x, y, z ("joint"), or the norm of all its entries ("element")
    earlier, newest : elements picked before, and in this step
    entry : vector index of the (first) entry picked in this step
    """

    k: int
    magnitude: np.ndarray
    earlier: np.ndarray
    newest: int
    entry: int


def iterations(
    V: np.ndarray, entries: np.ndarray, rows_per_element: int, rows: str, count: int
) -> list[Iteration]:
    """First ``count`` steps of a greedy selection.

    The residual of step k is v_k - V_{k-1} c with c from the equations sampled so far
    (Chaturantabut and Sorensen 2010, algorithm 1); the next sample is where it is largest.

    Parameters
    ----------
    V : (3 e p, rank) modes, p ``rows_per_element``
    entries : vector indices as selected: one a step for ``rows`` "scalar" and "joint" (there the x
        entry of a row stands for the row), 3 p a step for "element"

    Raises
    ------
    StorageError
        An entry lies outside the basis, or there are not enough for one step.
    """
    per_step = 3 * rows_per_element if rows == "element" else 1
    if len(entries) < per_step or entries.min() < 0 or entries.max() >= len(V):
        raise StorageError(f"{len(entries)} sampled entries do not fit a basis of {len(V)} rows")
    residual_of = _joint_residual if rows == "joint" else _shared_residual
    steps = []
    for k in range(min(count, len(entries) // per_step, V.shape[1])):
        residual = residual_of(V, entries[: k * per_step], k)
        picked = entries[: (k + 1) * per_step : per_step] // (3 * rows_per_element)
        steps.append(
            Iteration(
                k=k + 1,
                magnitude=_measured(residual, rows_per_element, rows),
                earlier=picked[:-1],
                newest=int(picked[-1]),
                entry=int(entries[k * per_step]),
            )
        )
    return steps


def _measured(residual: np.ndarray, rows_per_element: int, rows: str) -> np.ndarray:
    """Size of a residual (3 e p,) by elements (e,)."""
    length = {"scalar": 1, "joint": 3, "element": 3 * rows_per_element}[rows]
    norms = np.linalg.norm(residual.reshape(-1, length), axis=1)
    return norms.reshape(-1, 3 * rows_per_element // length).max(axis=1)


def _shared_residual(V: np.ndarray, entries: np.ndarray, k: int) -> np.ndarray:
    """Residual of mode k with coefficients shared by all axes; least squares when oversampled."""
    if k == 0:
        return V[:, 0]
    coefficients = np.linalg.lstsq(V[entries, :k], V[entries, k], rcond=None)[0]
    return V[:, k] - V[:, :k] @ coefficients


def _joint_residual(V: np.ndarray, entries: np.ndarray, k: int) -> np.ndarray:
    """Residual of mode k with one set of coefficients per axis, from the same rows."""
    split = V.reshape(-1, 3, V.shape[1])
    residual = np.empty(split.shape[:2])
    for axis in range(3):
        residual[:, axis] = _shared_residual(split[:, axis], entries // 3, k)
    return residual.ravel()
