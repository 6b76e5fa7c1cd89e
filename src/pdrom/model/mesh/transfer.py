"""Interpolation of displacements from the vertices of a mesh to other points."""

from itertools import combinations

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from pdrom.model.mesh.types import Mesh

FIRST = 16  # number of elements, nearest by their centres, that are tried first for a point
PAIRS = 1 << 18  # points times elements that are compared at a time
INSIDE = 1e-9  # part of the mesh: a point that is nearer to an element lies in it


def interpolation(mesh: Mesh, points: np.ndarray) -> sparse.csr_array:
    """Return the matrix (P, N) that interpolates values at the vertices of ``mesh`` linearly.

    Each of the ``points`` (P, 3) m gets the barycentric coordinates of the point of the mesh that
    is nearest to it, at rest: non-negative weights with sum one on the vertices of one element.
    """
    cells = mesh.tetrahedra if len(mesh.tetrahedra) else mesh.triangles
    corners = mesh.points[cells]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    chosen, weights = np.zeros(len(points), np.int64), np.empty((len(points), cells.shape[1]))
    distance, least = np.full(len(points), np.inf), np.empty(len(points))
    inside = INSIDE * mesh.extent
    # elements of about one size at a time: a large one would widen the search among all
    sizes = np.floor(np.log2(radii))
    for own in (np.flatnonzero(sizes == size) for size in np.unique(sizes)):
        tree, count, radius = cKDTree(centres[own]), min(FIRST, len(own)), radii[own].max()
        left = np.flatnonzero(distance > inside)
        while len(left):
            for part in np.array_split(left, -(-len(left) * count // PAIRS)):
                far, near = tree.query(points[part], k=np.arange(1, count + 1))
                found, apart = _nearest(corners[own[near]], points[part])
                best, rows = apart.argmin(axis=1), np.arange(len(part))
                nearer = apart[rows, best] < distance[part]
                rows, best, closer = rows[nearer], best[nearer], part[nearer]
                chosen[closer], weights[closer] = own[near[rows, best]], found[rows, best]
                distance[closer] = apart[rows, best]
                # an element that was not tried is no nearer than its centre less its radius
                least[part] = far[:, -1] - radius
            more = count < len(own)
            left = left[distance[left] > np.maximum(least[left], inside)] if more else left[:0]
            count = min(4 * count, len(own))
    starts = cells.shape[1] * np.arange(len(points) + 1)
    shape = (len(points), mesh.vertices)
    return sparse.csr_array((weights.ravel(), cells[chosen].ravel(), starts), shape=shape)


def _nearest(corners: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric coordinates (P, c, m) of the nearest points of elements, and distances (P, c) m.

    corners : (P, c, m, 3) m, of c elements for each of the ``points`` (P, 3) m
    """
    size = corners.shape[2]
    weights = np.zeros(corners.shape[:3])
    distance = np.full(corners.shape[:2], np.inf)
    # the nearest point lies inside the element, a side, an edge, or is a corner
    for part in (p for n in range(size, 0, -1) for p in combinations(range(size), n)):
        first, others = corners[:, :, part[0]], corners[:, :, part[1:]]
        edges = others - first[:, :, None]
        gram = edges @ edges.swapaxes(2, 3)
        seen = edges @ (points[:, None] - first)[..., None]
        shares = np.linalg.solve(gram, seen)[..., 0] if len(part) > 1 else seen[..., 0]
        own = np.concatenate([1.0 - shares.sum(axis=-1, keepdims=True), shares], axis=-1)
        at = np.einsum("pcm,pcmd->pcd", own, corners[:, :, part])
        apart = np.linalg.norm(at - points[:, None], axis=-1)
        nearer = (own >= -INSIDE).all(axis=-1) & (apart < distance)
        shares = np.zeros_like(weights)
        shares[..., list(part)] = np.maximum(own, 0.0)
        weights[nearer], distance[nearer] = shares[nearer], apart[nearer]
    return weights / weights.sum(axis=-1, keepdims=True), distance
