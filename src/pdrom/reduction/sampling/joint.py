"""The paper's variant of DEIM: one row for x, y and z by the joint residual norm."""

import numpy as np


def joint_rows(v: np.ndarray, active: tuple[bool, ...], repeat: bool) -> np.ndarray:
    """Row indices (r,) of the basis ``v`` (3 rows, r), nested in r.

    For mode k each axis a has its own system (P^T V_a) c_a = P^T v_{k,a}; the row with the largest
    sum of the squared residuals of the three axes is taken for all of them. A singular system is
    solved in the least-squares sense: the row was chosen for the joint norm and may be useless for
    one axis. The published code does not exclude rows that it has already (``repeat``); otherwise
    there are fewer than r rows if the basis has no more.
    """
    rows = len(v) // 3
    axes = np.flatnonzero(active)
    by_axis = v.reshape(rows, 3, -1)
    picked: list[int] = []
    for k in range(v.shape[1] if repeat else min(v.shape[1], rows)):
        norm = np.zeros(rows)
        for axis in axes:
            basis, mode = by_axis[:, axis, :k], by_axis[:, axis, k]
            if k:
                small = basis[picked]
                mode = mode - basis @ np.linalg.lstsq(small, mode[picked], rcond=None)[0]
            norm += mode**2
        if not repeat:
            norm[picked] = -1.0
        picked.append(int(np.argmax(norm)))
    return np.array(picked, dtype=np.int64)
