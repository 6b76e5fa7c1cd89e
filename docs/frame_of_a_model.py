"""Compute the first frame of a model of springs, sheet.model.h5, without pdrom."""

import h5py
import numpy as np

with h5py.File("sheet.model.h5") as file:
    B, frame = file["model/columns/B"][...], file["frame"]
    A, M, z, v, held, targets = (
        frame[name][...]
        for name in ("matrix", "inertia", "positions", "velocities", "held", "targets")
    )
    h, iterations = frame.attrs["time_step"], frame.attrs["iterations"]
    forces = [(f["constant"][...], f["rate"][()]) for f in frame.get("forces", {}).values()]
    D, w = (frame[f"groups/spring/{name}"][...] for name in ("strain", "weights"))
free = np.setdiff1d(np.arange(len(z)), held)
length = np.linalg.norm(D @ z, axis=1, keepdims=True)  # at rest
s = z + h * v + h**2 * sum(c + (r @ v if np.ndim(r) else r * v) for c, r in forces)
s[held] = targets
y = s.copy()
for _ in range(iterations):
    d = D @ y
    p = length * d / np.linalg.norm(d, axis=1, keepdims=True)
    right = M @ s + D.T @ (w[:, None] * p)
    known = right[free] - A[np.ix_(free, held)] @ targets
    y[free] = np.linalg.solve(A[np.ix_(free, free)], known)
positions = B @ y
