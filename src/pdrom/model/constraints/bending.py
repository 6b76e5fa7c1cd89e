"""Vertex bending: the mean-curvature vector keeps its rest magnitude (Bouaziz et al. 2014, 5.4)."""

from copy import copy
from typing import Literal

import numpy as np
from scipy import sparse

from pdrom.core.errors import SceneError
from pdrom.model.constraints.base import ConstraintGroup, GroupConfig, require_cells
from pdrom.model.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.model.constraints.lanes import (
    LANES,
    SMALLEST,
    absolute_sum,
    choose,
    dot,
    kernel,
    lane_function,
    load,
    mix,
    perpendicular,
    save,
    scaled,
    square_distance,
    workspace,
)
from pdrom.model.constraints.parts import Parts
from pdrom.model.mesh.types import Mesh

# Rest curvature below this (relative to the cancelling terms) is flat: it has no side to keep.
FLAT = 1e-9
# A rim direction below this has been lost to round-off.
RIM = 1e-15

# numbers of a lane in the working array: curvature, side times normal, magnitude, p, weight,
# energy, rest curvature
H, NORMAL, MAGNITUDE, P, WEIGHT, ENERGY, REST, SIZE = 0, 3, 6, 7, 10, 11, 12, 15


@lane_function
def _gather(y, e, lane, operator, manifold, work):
    """Curvature vector and manifold of element e."""
    indptr, indices, data = operator
    rest, magnitude, side, normals, weights = manifold
    hx, hy, hz = 0.0, 0.0, 0.0
    for k in range(indptr[e], indptr[e + 1]):
        v = indices[k]
        hx += data[k] * y[v, 0]
        hy += data[k] * y[v, 1]
        hz += data[k] * y[v, 2]
    save(work, H, lane, (hx, hy, hz))
    save(work, NORMAL, lane, scaled(side[e], (normals[e, 0], normals[e, 1], normals[e, 2])))
    save(work, REST, lane, (rest[e, 0], rest[e, 1], rest[e, 2]))
    work[MAGNITUDE * LANES + lane] = magnitude[e]
    work[WEIGHT * LANES + lane] = weights[e]


@lane_function
def _half_spheres(work):
    """Nearest points of the half spheres to the curvature vectors of a block."""
    for lane in range(LANES):
        h, n = load(work, H, lane), load(work, NORMAL, lane)
        # scaled: neither overflow nor underflow of the squares
        scale = absolute_sum(h)
        unit = scaled(1.0 / (scale + SMALLEST), h)
        unit = scaled(1.0 / np.sqrt(dot(unit, unit)), unit)
        height = dot(unit, n)
        rim = mix(1.0, unit, -height, n)
        length = np.sqrt(dot(rim, rim))
        rim = choose(length > RIM, scaled(1.0 / length, rim), perpendicular(n))
        unit = choose(height < 0.0, rim, unit)
        magnitude = work[MAGNITUDE * LANES + lane]
        pole = choose(dot(n, n) == 0.0, load(work, REST, lane), scaled(magnitude, n))
        p = choose(scale == 0.0, pole, scaled(magnitude, unit))
        save(work, P, lane, p)
        work[ENERGY * LANES + lane] = work[WEIGHT * LANES + lane] * square_distance(h, p)


@kernel
def _project(y, elements, operator, manifold, work, p):
    count = elements.shape[0]
    for start in range(0, count, LANES):
        for lane in range(LANES):
            _gather(y, elements[min(start + lane, count - 1)], lane, operator, manifold, work)
        _half_spheres(work)
        for lane in range(min(LANES, count - start)):
            i = start + lane
            p[i, 0], p[i, 1], p[i, 2] = load(work, P, lane)


@kernel
def _accumulate(y, operator, manifold, first, last, work, rhs):
    indptr, indices, data = operator
    energy = 0.0
    for start in range(first, last, LANES):
        for lane in range(LANES):
            _gather(y, min(start + lane, last - 1), lane, operator, manifold, work)
        _half_spheres(work)
        for lane in range(min(LANES, last - start)):
            px, py, pz = scaled(work[WEIGHT * LANES + lane], load(work, P, lane))
            for k in range(indptr[start + lane], indptr[start + lane + 1]):
                v = indices[k]
                rhs[v, 0] += data[k] * px
                rhs[v, 1] += data[k] * py
                rhs[v, 2] += data[k] * pz
            energy += work[ENERGY * LANES + lane]
    return 0.5 * energy


@gradient_kernel
def _project_gradients(d_pointer, manifold_pointer, p_pointer, m):
    d, p = carray(d_pointer, (m, 3)), carray(p_pointer, (m, 3))
    manifold = carray(manifold_pointer, (m, 7))
    work = np.zeros(SIZE * LANES)
    for start in range(0, m, LANES):
        for lane in range(LANES):
            e = min(start + lane, m - 1)
            save(work, H, lane, (d[e, 0], d[e, 1], d[e, 2]))
            save(work, NORMAL, lane, (manifold[e, 0], manifold[e, 1], manifold[e, 2]))
            work[MAGNITUDE * LANES + lane] = manifold[e, 3]
            save(work, REST, lane, (manifold[e, 4], manifold[e, 5], manifold[e, 6]))
        _half_spheres(work)
        for lane in range(min(LANES, m - start)):
            i = start + lane
            p[i, 0], p[i, 1], p[i, 2] = load(work, P, lane)


@kernel
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
        scale = absolute_sum((nx, ny, nz))
        if scale > 0.0:
            unit = scaled(1.0 / (scale + SMALLEST), (nx, ny, nz))
            nx, ny, nz = scaled(1.0 / np.sqrt(dot(unit, unit)), unit)
        normals[i, 0], normals[i, 1], normals[i, 2] = nx, ny, nz


class VertexBending(ConstraintGroup):
    """One constraint per interior vertex, weight w A_v (barycentric area).

    S q is the mean-curvature vector H(q) = 1/(2 A_v) sum_j (cot a_j + cot b_j)(q_v - q_j). With
    the rest magnitude m and the side s of the rest vector against the vertex normal, the manifold
    is the half sphere { |p| = m, s p.n >= 0 }; n is the normal at the beginning of the frame, so
    that the manifold is fixed during the iterations and the objective cannot rise. On the right
    side p has the direction of H; on the wrong side it is the nearest point of the rim, which pulls
    the vertex back: no flip. A flat rest shape has m = 0 up to round-off and needs no side.
    Where H = 0 the nearest point is the pole; where the fan has no area either there is no pole,
    and p is the rest vector.
    """

    class Config(GroupConfig):
        """Weight w per area."""

        effect: Literal["bending"] = "bending"

    rows_per_element = 1
    split_from = 4096
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
        self._set_buffers()

    def _set_rest(self, points: np.ndarray) -> None:
        curvature = self.S @ points
        self.rest = curvature
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
        _project(y, elements, self._operator(), self._manifold(), self._work[0], p)
        return p

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        operator, manifold = self._operator(), self._manifold()

        def part(first: int, last: int, part: int, target: np.ndarray) -> float:
            return _accumulate(y, operator, manifold, first, last, self._work[part], target)

        return self._parts.accumulate(part, rhs, self.threads)

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
        part.rest, part.magnitude = self.rest[elements], self.magnitude[elements]
        part.side = self.side[elements]
        part.normals = self.normals[elements].copy()
        part._curved = np.flatnonzero(part.side)
        part._set_buffers()
        return part, vertices

    def _operator(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.S.indptr, self.S.indices, self.S.data

    def _manifold(self) -> tuple[np.ndarray, ...]:
        return self.rest, self.magnitude, self.side, self.normals, self.weights

    def _set_buffers(self) -> None:
        self._work = [workspace(SIZE) for _ in range(2)]
        self._parts = Parts(
            self.elements,
            self.elements >= self.split_from,
            self.S.shape[1],
            lambda element: self.S.indices[self.S.indptr[element] :],
        )

    @property
    def gradient_kernel(self):
        return _project_gradients

    def kernel_parameters(self) -> np.ndarray:
        return np.column_stack([self.side[:, None] * self.normals, self.magnitude, self.rest])

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
        p = unit * self.magnitude[elements, None]
        return np.where((unit != 0.0).any(axis=1)[:, None], p, self.rest[elements])[:, None, :]


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
