"""Linear blend skinning columns (after Brandt et al. 2018, sect. 4)."""

import numpy as np

from pdrom.model.mesh.select import farthest_points
from pdrom.reduction.basis.pod import pod
from pdrom.reduction.subspace.columns import DEPENDENT, affine_columns, orthonormal


def skinning_weights(points: np.ndarray, handles: int) -> np.ndarray:
    """Weights (N, handles) at ``points`` (N, 3) m: smooth, in [0, 1], summing to 1 at every vertex.

    Handles are vertices by farthest-point sampling. Each has the compactly supported kernel
    (1 - d/R)^4 (4 d/R + 1) of Wendland with R three times the covering radius, so that every vertex
    is reached; dividing by the sum makes a partition of unity.
    """
    chosen = farthest_points(points, np.arange(len(points)), handles)
    distance = np.linalg.norm(points[:, None, :] - points[chosen][None], axis=2)
    radius = 3.0 * distance.min(axis=1).max() if handles > 1 else 2.0 * distance.max()
    # where every vertex is a handle the covering radius is zero, and all distances of a single one
    radius = max(radius, np.finfo(float).eps * distance.max(), np.finfo(float).tiny)
    scaled = np.minimum(distance / radius, 1.0)
    kernel = (1.0 - scaled) ** 4 * (4.0 * scaled + 1.0)
    return kernel / kernel.sum(axis=1, keepdims=True)


def skinning_modes(points: np.ndarray, masses: np.ndarray, k: int) -> np.ndarray:
    """k mass-orthonormal columns (N, k) of the span of w_h [1, x, y, z], affine part removed.

    The handles are as many as give k columns; of the last handle's columns those with the largest
    singular values are kept, so that bases of equal size can be compared.

    Parameters
    ----------
    points : (N, 3) m
    masses : (N,) kg
    """
    weight = np.sqrt(masses)[:, None]
    fields = affine_columns(points - points.mean(axis=0))
    affine = orthonormal(weight * fields)
    handles = 2
    while True:
        weights = skinning_weights(points, handles)
        columns = weight * (weights[:, :, None] * fields[:, None, :]).reshape(len(points), -1)
        rest = columns - affine @ (affine.T @ columns)
        modes, sigma = pod(rest)
        useful = int(np.count_nonzero(sigma > DEPENDENT * sigma[0]))
        if useful >= k or handles == len(points):
            return modes[:, : min(k, useful)] / weight
        handles += 1
