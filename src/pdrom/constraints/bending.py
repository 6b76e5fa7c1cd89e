"""Vertex bending: the mean-curvature vector keeps its rest magnitude (Bouaziz et al. 2014, 5.4)."""

from copy import copy
from typing import Literal

import numpy as np
from numba import njit
from scipy import sparse

from pdrom.constraints.base import ConstraintGroup, GroupConfig, require_cells
from pdrom.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.constraints.vectors import perpendicular
from pdrom.errors import SceneError
from pdrom.mesh.types import Mesh

# Rest curvature below this (relative to the cancelling terms) is flat: it has no side to keep.
FLAT = 1e-9


class VertexBending(ConstraintGroup):
    """One constraint per interior vertex, weight w A_v (barycentric area).

    S q is the mean-curvature vector H(q) = 1/(2 A_v) sum_j (cot a_j + cot b_j)(q_v - q_j). With
    the rest magnitude m and the side s of the rest vector against the vertex normal, the manifold
    is the half sphere { |p| = m, s p.n >= 0 }; n is the normal at the beginning of the frame, so
    that the manifold is fixed during the iterations and the objective cannot rise. On the right
    side p has the direction of H; on the wrong side it is the nearest point of the rim, which pulls
    the vertex back: no flip. A flat rest shape has m = 0 up to round-off and needs no side.
    """

    class Config(GroupConfig):
        """Weight w per area."""

        effect: Literal["bending"] = "bending"

    rows_per_element = 1
    frame_lagged = True

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._triangles = require_cells(mesh, "triangles", self.name)
        self.vertices = interior_vertices(self._triangles, mesh.vertices)
        if len(self.vertices) == 0:
            raise SceneError(f"effect '{self.name}' needs interior vertices, this mesh has none")
        area = barycentric_areas(mesh.points, self._triangles)[self.vertices]
        self.weights = config.weight * area
        laplacian = cotangent_laplacian(mesh.points, self._triangles)[self.vertices]
        self.S = sparse.csr_array(laplacian.multiply(0.5 / area[:, None]))
        self.S.sort_indices()
        self._set_rest(mesh.points)

    def _set_rest(self, points: np.ndarray) -> None:
        curvature = self.S @ points
        self.magnitude = np.linalg.norm(curvature, axis=1)
        cancelling = np.linalg.norm(abs(self.S) @ np.abs(points), axis=1)
        normals = np.zeros_like(curvature)
        fans = vertex_fans(self._triangles, len(points))
        self._fan_start, self._fan = fans
        _fan_normals(points, self.vertices, self._fan_start, self._fan, self._triangles, normals)
        side = np.sign(np.einsum("ij,ij->i", curvature, normals))
        self.side = np.where(self.magnitude > FLAT * cancelling, side, 0.0)
        self._curved = np.flatnonzero(self.side)
        self.normals = normals

    def begin_frame(self, q: np.ndarray, elements: np.ndarray | None = None) -> None:
        """Take the vertex normals of q; only curved vertices (of ``elements``) need them."""
        curved = self._curved
        if elements is not None:
            curved = elements[self.side[elements] != 0.0]
        if len(curved) == 0:
            return
        normals = np.zeros((len(curved), 3))
        _fan_normals(q, self.vertices[curved], self._fan_start, self._fan, self._triangles, normals)
        self.normals[curved] = normals

    def project_elements(self, y: np.ndarray, elements: np.ndarray) -> np.ndarray:
        p = np.empty((len(elements), 3))
        _project(y, elements, *self._operator(), self.magnitude, self.side, self.normals, p)
        return p

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        return _accumulate(
            y, *self._operator(), self.magnitude, self.side, self.normals, self.weights, rhs
        )

    def restricted(
        self, elements: np.ndarray, factors: np.ndarray
    ) -> tuple[ConstraintGroup, np.ndarray]:
        own = self.vertices[elements]
        fans = [self._fan[self._fan_start[v] : self._fan_start[v + 1]] for v in own]
        triangles = self._triangles[np.unique(np.concatenate(fans))]
        rows = self.S[elements]
        vertices = np.union1d(rows.indices, triangles)
        part = copy(self)
        part.vertices = np.searchsorted(vertices, own)
        part._triangles = np.searchsorted(vertices, triangles).astype(np.int32)
        part._fan_start, part._fan = vertex_fans(part._triangles, len(vertices))
        part.S = sparse.csr_array(rows[:, vertices])
        part.S.sort_indices()
        part.weights = self.weights[elements] * factors
        part.magnitude, part.side = self.magnitude[elements], self.side[elements]
        part.normals = self.normals[elements].copy()
        part._curved = np.flatnonzero(part.side)
        return part, vertices

    @property
    def gradient_kernel(self):
        return _project_gradients

    def kernel_parameters(self) -> np.ndarray:
        return np.column_stack([self.magnitude, self.side, self.normals])

    def _operator(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.S.indptr, self.S.indices, self.S.data

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        h, n = d[:, 0], self.normals[elements] * self.side[elements, None]
        length = np.linalg.norm(h, axis=1, keepdims=True)
        direction = np.where(length > 0.0, h / np.where(length > 0.0, length, 1.0), 0.0)
        height = np.einsum("ij,ij->i", direction, n)[:, None]
        rim = direction - height * n
        rim_length = np.linalg.norm(rim, axis=1, keepdims=True)
        rim = np.where(
            rim_length > 1e-15, rim / np.where(rim_length > 0.0, rim_length, 1.0), _crossing(n)
        )
        unit = np.where((height < 0.0) & (n != 0.0).any(axis=1)[:, None], rim, direction)
        unit = np.where(length > 0.0, unit, n)
        return (unit * self.magnitude[elements, None])[:, None, :]


def _crossing(n: np.ndarray) -> np.ndarray:
    """A unit vector at right angles to each row of n, always the same one."""
    k = np.argmin(np.abs(n), axis=1)
    i, j = (k + 1) % 3, (k + 2) % 3
    rows = np.arange(len(n))
    out = np.zeros_like(n)
    out[rows, i], out[rows, j] = n[rows, j], -n[rows, i]
    length = np.linalg.norm(out, axis=1, keepdims=True)
    return out / np.where(length > 0.0, length, 1.0)


def interior_vertices(triangles: np.ndarray, vertices: int) -> np.ndarray:
    """Vertices (n,) on no boundary edge, ascending."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    inside = np.ones(vertices, dtype=bool)
    inside[unique[count == 1]] = False
    return np.flatnonzero(inside)


def barycentric_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """A third of the area of the adjacent triangles, (N,) m^2."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.bincount(triangles.ravel(), np.repeat(area / 3.0, 3), minlength=len(points))


def cotangent_laplacian(points: np.ndarray, triangles: np.ndarray) -> sparse.csr_array:
    """(L q)_v = sum_j (cot a_j + cot b_j)(q_v - q_j), (N, N) CSR (Pinkall and Polthier 1993)."""
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
    """Triangles around each vertex: ``fan[start[v]:start[v + 1]]``."""
    order = np.argsort(triangles.ravel(), kind="stable")
    counts = np.bincount(triangles.ravel(), minlength=vertices)
    start = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return start, (order // 3).astype(np.int64)


@njit(cache=True, error_model="numpy")
def _fan_normals(q, vertices, start, fan, triangles, normals):
    """Area-weighted unit normals of ``vertices``; zero where the fan has no area."""
    for i in range(vertices.shape[0]):
        nx, ny, nz = 0.0, 0.0, 0.0
        for k in range(start[vertices[i]], start[vertices[i] + 1]):
            a, b, c = triangles[fan[k], 0], triangles[fan[k], 1], triangles[fan[k], 2]
            ux, uy, uz = q[b, 0] - q[a, 0], q[b, 1] - q[a, 1], q[b, 2] - q[a, 2]
            vx, vy, vz = q[c, 0] - q[a, 0], q[c, 1] - q[a, 1], q[c, 2] - q[a, 2]
            nx += uy * vz - uz * vy
            ny += uz * vx - ux * vz
            nz += ux * vy - uy * vx
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if length > 0.0:
            nx, ny, nz = nx / length, ny / length, nz / length
        normals[i, 0], normals[i, 1], normals[i, 2] = nx, ny, nz


@njit(cache=True, error_model="numpy")
def _curvature(y, e, indptr, indices, data):
    hx, hy, hz = 0.0, 0.0, 0.0
    for k in range(indptr[e], indptr[e + 1]):
        hx += data[k] * y[indices[k], 0]
        hy += data[k] * y[indices[k], 1]
        hz += data[k] * y[indices[k], 2]
    return hx, hy, hz


@njit(cache=True, error_model="numpy")
def _half_sphere(hx, hy, hz, magnitude, side, normal):
    """Nearest point of the half sphere to (hx, hy, hz)."""
    nx, ny, nz = side * normal[0], side * normal[1], side * normal[2]
    length = np.sqrt(hx * hx + hy * hy + hz * hz)
    if length == 0.0:
        return magnitude * nx, magnitude * ny, magnitude * nz
    dx, dy, dz = hx / length, hy / length, hz / length
    height = dx * nx + dy * ny + dz * nz
    if height < 0.0:
        dx, dy, dz = dx - height * nx, dy - height * ny, dz - height * nz
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        if length > 1e-15:
            dx, dy, dz = dx / length, dy / length, dz / length
        else:
            dx, dy, dz = perpendicular(nx, ny, nz)
    return magnitude * dx, magnitude * dy, magnitude * dz


@njit(cache=True, error_model="numpy")
def _project(y, elements, indptr, indices, data, magnitude, side, normals, p):
    for i in range(elements.shape[0]):
        e = elements[i]
        hx, hy, hz = _curvature(y, e, indptr, indices, data)
        p[i, 0], p[i, 1], p[i, 2] = _half_sphere(hx, hy, hz, magnitude[e], side[e], normals[e])


@njit(cache=True, error_model="numpy")
def _accumulate(y, indptr, indices, data, magnitude, side, normals, weights, rhs):
    energy = 0.0
    for e in range(weights.shape[0]):
        hx, hy, hz = _curvature(y, e, indptr, indices, data)
        px, py, pz = _half_sphere(hx, hy, hz, magnitude[e], side[e], normals[e])
        w = weights[e]
        for k in range(indptr[e], indptr[e + 1]):
            scaled = w * data[k]
            rhs[indices[k], 0] += scaled * px
            rhs[indices[k], 1] += scaled * py
            rhs[indices[k], 2] += scaled * pz
        energy += w * ((hx - px) ** 2 + (hy - py) ** 2 + (hz - pz) ** 2)
    return 0.5 * energy


@gradient_kernel
def _project_gradients(d_pointer, parameters_pointer, p_pointer, m):
    d, p = carray(d_pointer, (m, 3)), carray(p_pointer, (m, 3))
    of = carray(parameters_pointer, (m, 5))
    for i in range(m):
        p[i, 0], p[i, 1], p[i, 2] = _half_sphere(
            d[i, 0], d[i, 1], d[i, 2], of[i, 0], of[i, 1], of[i, 2:]
        )
