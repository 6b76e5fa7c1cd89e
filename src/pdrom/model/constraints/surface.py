"""Vertices of a triangle mesh: normals, cotangent Laplacian."""

import math

import numpy as np
from scipy import sparse

from pdrom.model.constraints.lanes import (
    SMALLEST,
    absolute_sum,
    cross,
    dot,
    kernel,
    lane_function,
    scaled,
)
from pdrom.model.mesh.measures import boundary_edges


def interior_vertices(triangles: np.ndarray, vertices: int) -> np.ndarray:
    """Vertices (n,) of ``triangles`` (T, 3) on no boundary edge, ascending; of all ``vertices``."""
    inside = np.ones(vertices, dtype=bool)
    inside[boundary_edges(triangles)] = False
    return np.flatnonzero(inside)


def cotangent_laplacian(points: np.ndarray, triangles: np.ndarray) -> sparse.csr_array:
    """(L q)_v = sum_j (cot a_j + cot b_j)(q_v - q_j), (N, N) CSR (Pinkall and Polthier 1993).

    Parameters
    ----------
    points : (N, 3) m
    triangles : (T, 3)
    """
    n = len(points)
    rows, columns, values = [], [], []
    for corner in range(3):
        o, i, j = (triangles[:, (corner + k) % 3] for k in range(3))
        u, v = points[i] - points[o], points[j] - points[o]
        cotangent = np.einsum("ij,ij->i", u, v) / np.linalg.norm(np.cross(u, v), axis=1)
        for a, b in ((i, j), (j, i)):
            rows += [a, a]
            columns += [a, b]
            values += [cotangent, -cotangent]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.coo_array(entries, shape=(n, n)).tocsr()


def vertex_fans(triangles: np.ndarray, vertices: int) -> tuple[np.ndarray, np.ndarray]:
    """``triangles`` (T, 3) around each of ``vertices``: ``fan[start[v]:start[v + 1]]``."""
    order = np.argsort(triangles.ravel(), kind="stable")
    counts = np.bincount(triangles.ravel(), minlength=vertices)
    start = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return start, (order // 3).astype(np.int64)


@lane_function
def _sides(q, triangle):
    """Edges of a triangle from its first corner."""
    a, b, c = triangle[0], triangle[1], triangle[2]
    return (
        (q[b, 0] - q[a, 0], q[b, 1] - q[a, 1], q[b, 2] - q[a, 2]),
        (q[c, 0] - q[a, 0], q[c, 1] - q[a, 1], q[c, 2] - q[a, 2]),
    )


@kernel
def fan_normals(q, vertices, elements, start, fan, triangles, normals):
    """Write the area-weighted unit normals of the vertices of some elements to their rows.

    Zero where the fan has no area.

    Parameters
    ----------
    q : (N, 3) positions
    vertices : (m,) vertex of each element
    elements : those whose row of ``normals`` (m, 3) is written
    start, fan : the triangles at vertex v are ``fan[start[v]:start[v + 1]]``
    triangles : (T, 3) vertices
    """
    for i in elements:
        first, last = start[vertices[i]], start[vertices[i] + 1]
        largest = 0.0
        for k in range(first, last):
            u, v = _sides(q, triangles[fan[k]])
            largest = max(largest, absolute_sum(u), absolute_sum(v))
        # a power of two: neither overflow nor underflow of the products, and no rounding
        power = 2.0 ** min(-math.frexp(largest)[1], 1000)
        nx, ny, nz = 0.0, 0.0, 0.0
        for k in range(first, last):
            u, v = _sides(q, triangles[fan[k]])
            x, y, z = cross(scaled(power, u), scaled(power, v))
            nx, ny, nz = nx + x, ny + y, nz + z
        scale = absolute_sum((nx, ny, nz))
        if scale > 0.0:
            unit = scaled(1.0 / (scale + SMALLEST), (nx, ny, nz))
            nx, ny, nz = scaled(1.0 / np.sqrt(dot(unit, unit)), unit)
        normals[i, 0], normals[i, 1], normals[i, 2] = nx, ny, nz
