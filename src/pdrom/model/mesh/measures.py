"""Measures of a mesh around its vertices, and its boundary."""

import numpy as np

from pdrom.model.mesh.types import Mesh


def barycentric_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """A third of the area of the adjacent ``triangles`` (T, 3) at ``points`` (N, 3) m, (N,) m^2."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.bincount(triangles.ravel(), np.repeat(area / 3.0, 3), minlength=len(points))


def barycentric_volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """A quarter of the volume of the adjacent ``tetrahedra`` at ``points`` (N, 3) m, (N,) m^3."""
    corner = points[tetrahedra]
    volume = np.abs(np.linalg.det(corner[:, 1:] - corner[:, :1])) / 6.0
    return np.bincount(tetrahedra.ravel(), np.repeat(volume / 4.0, 4), minlength=len(points))


def vertex_measures(mesh: Mesh) -> np.ndarray:
    """Share of each vertex in the rest shape (N,): m^3 of a volume mesh, m^2 of a surface."""
    if len(mesh.tetrahedra):
        return barycentric_volumes(mesh.points, mesh.tetrahedra)
    return barycentric_areas(mesh.points, mesh.triangles)


def boundary_edges(triangles: np.ndarray) -> np.ndarray:
    """Edges (n, 2) that belong to one of the ``triangles`` (T, 3) only, sorted."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    # one number an edge: rows are sorted twenty times slower
    size = int(edges.max()) + 1
    unique, count = np.unique(edges[:, 0] * np.int64(size) + edges[:, 1], return_counts=True)
    return np.column_stack(np.divmod(unique[count == 1], size)).astype(edges.dtype)
