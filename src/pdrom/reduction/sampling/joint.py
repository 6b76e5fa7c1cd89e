"""The preprint's variant of DEIM: one row for x, y and z by the joint residual norm."""

import numpy as np

from pdrom.reduction.sampling.deim import tie_weights
from pdrom.reduction.sampling.growing_fit import GrowingFit


def joint_rows(
    v: np.ndarray,
    active: tuple[bool, ...],
    repeat: bool,
    factors: np.ndarray | None = None,
) -> np.ndarray:
    """Row indices (r,) of the basis ``v`` (3 rows, r), nested in r.

    For mode k each axis a has its own system (P^T V_a) c_a = P^T v_{k,a}; the row with the largest
    sum of the squared residuals of the three axes (times `tie_weights`) is taken for all of them. A
    singular system is solved in the least-squares sense: the row was chosen for the joint norm and
    may be useless for one axis. The published code does not exclude rows that it has already
    (``repeat``); otherwise there are fewer than r rows if the basis has no more. ``factors``
    (rows,) take the place of `tie_weights`.

    Parameters
    ----------
    active : which of the three axes move
    """
    rows, r = len(v) // 3, v.shape[1]
    axes = [(np.asfortranarray(v[a::3]), GrowingFit(r)) for a in np.flatnonzero(active)]
    weights = (tie_weights(rows) if factors is None else factors) ** 2
    picked = np.empty(r if repeat else min(r, rows), dtype=np.int64)
    for k in range(len(picked)):
        norm = np.zeros(rows)
        for modes, fit in axes:
            residual = modes[:, k] - modes[:, :k] @ fit.coefficients(k) if k else modes[:, k]
            norm += residual**2
        norm *= weights
        if not repeat:
            norm[picked[:k]] = -1.0
        picked[k] = row = int(np.argmax(norm))
        for modes, fit in axes:
            fit.add(modes[row : row + 1])
    return picked
