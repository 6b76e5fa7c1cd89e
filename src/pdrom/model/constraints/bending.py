"""Vertex bending: the mean-curvature vector keeps its rest magnitude (Bouaziz et al. 2014, 5.4)."""

import math
from copy import copy
from typing import Any, Literal, Self

import numpy as np
from scipy import sparse

from pdrom.core.errors import SceneError
from pdrom.model.compiled import arithmetic, rows
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, at
from pdrom.model.constraints import lanes
from pdrom.model.constraints import local_kernel as kernels
from pdrom.model.constraints.base import ConstraintGroup, GroupConfig, directions, require_cells
from pdrom.model.constraints.local_kernel import OWN, VERTICES, LocalKernel
from pdrom.model.constraints.simplex import copy_rows, store_projections
from pdrom.model.mesh.types import Mesh, barycentric_areas, boundary_edges

# Below this length a unit vector's component orthogonal to the vertex normal is a rounding error.
RIM = 1e-15
# A unit vector's component in the plane of a half sphere's rim, if longer than this, is orthogonal
# to the vertex normal up to 2e-12. A shorter one has lost digits and is made orthogonal once more.
NEAR_POLE = 1e-4

# Offsets of an element's weight, curvature at rest (magnitude and vector) and pole of its half
# sphere (normal times side +1, -1 or 0) among the MANIFOLD numbers that `lanes.pack` packs for it
WEIGHT, MAGNITUDE, REST, POLE, MANIFOLD = 0, 1, 2, 5, 8
# Offsets in a working array, SIZE numbers per lane: H(q), projection p, cosine of H and the POLE
H, P, HEIGHT, SIZE = 0, 3, 6, 7
# Indices into a kernel's record: numbers of blocks, elements, elements to project; addresses of the
# CSR arrays of S, packed numbers, working array, elements to project, memory for their numbers.
BLOCKS, ELEMENTS, COUNT, START, INDICES, DATA = range(OWN, OWN + 6)
SPHERES, WORK, SAMPLED, TAKEN, ARRAYS = range(OWN + 6, OWN + 11)


@compiled(nogil=True)
def put_poles(manifold, elements, side, normals):
    """Write half-sphere poles ``side`` (m,) * ``normals`` (m, 3) of elements to ``manifold``."""
    for e in elements:
        place = (e // lanes.LANES * MANIFOLD + POLE) * lanes.LANES + e % lanes.LANES
        lanes.save(
            manifold, 0, place, lanes.scaled(side[e], (normals[e, 0], normals[e, 1], normals[e, 2]))
        )


@lanes.lane_function
def _curvature(y, e, start, indices, data):
    """Return the mean-curvature vector of element e at the positions y; the operator S is CSR."""
    h = arithmetic.constant(0.0)
    for k in range(at(start, e), at(start, e + 1)):
        h = arithmetic.add_scaled(h, at(data, k), rows.load(y, WIDTH * at(indices, k)))
    return h


@lanes.lane_function
def _without(a, part, n):
    """Return direction and length of a - part n, from vectors a and n and a number ``part``."""
    rest = lanes.mix(1.0, a, -part, n)
    length = np.sqrt(lanes.dot(rest, rest))
    return lanes.scaled(1.0 / length, rest), length


@lanes.lane_function
def _half_spheres(work, manifold, block):
    """Project the curvature vectors of a block onto their half spheres (see `VertexBending`)."""
    first, wrong = block * MANIFOLD, 0.0
    for lane in range(lanes.LANES):
        h, n = lanes.load(work, H, lane), lanes.load(manifold, first + POLE, lane)
        # scale the vector so that its squares neither overflow nor underflow
        scale = lanes.absolute_sum(h)
        unit = lanes.scaled(1.0 / (scale + lanes.SMALLEST), h)
        unit = lanes.scaled(1.0 / np.sqrt(lanes.dot(unit, unit)), unit)
        lanes.save(work, P, lane, unit)
        work[HEIGHT * lanes.LANES + lane] = lanes.dot(unit, n)
    for lane in range(lanes.LANES):
        wrong += 1.0 if work[HEIGHT * lanes.LANES + lane] < 0.0 else 0.0
    if wrong > 0.0:
        _to_rims(work, manifold, first)
    for lane in range(lanes.LANES):
        n, unit = lanes.load(manifold, first + POLE, lane), lanes.load(work, P, lane)
        magnitude = at(manifold, (first + MAGNITUDE) * lanes.LANES + lane)
        pole = lanes.choose(
            lanes.dot(n, n) == 0.0,
            lanes.load(manifold, first + REST, lane),
            lanes.scaled(magnitude, n),
        )
        vanishes = lanes.absolute_sum(lanes.load(work, H, lane)) == 0.0
        lanes.save(work, P, lane, lanes.choose(vanishes, pole, lanes.scaled(magnitude, unit)))


@lanes.lane_function
def _to_rims(work, manifold, first):
    """Replace directions below the rim (equator) of their half sphere by the nearest rim points."""
    for lane in range(lanes.LANES):
        n, unit = lanes.load(manifold, first + POLE, lane), lanes.load(work, P, lane)
        height = work[HEIGHT * lanes.LANES + lane]
        rim, length = _without(unit, height, n)
        again, left = _without(rim, lanes.dot(rim, n), n)
        # if ``unit`` is along n, ``rim`` is a rounding error: take any direction orthogonal to n
        again = lanes.choose(length > RIM and left > 0.5, again, lanes.perpendicular(n))
        rim = lanes.choose(length > NEAR_POLE, rim, again)
        lanes.save(work, P, lane, lanes.choose(height < 0.0, rim, unit))


@lanes.lane_function
def _arguments(y_place, record):
    """Return positions y (at address ``y_place``) and what ``record`` points to: CSR arrays of S,
    packed numbers and the working array."""
    entries = rows.indices(record, ARRAYS)
    y = rows.doubles(y_place, WIDTH * entries[VERTICES])
    start = rows.integers(entries[START], entries[ELEMENTS] + 1)
    count = at(start, entries[ELEMENTS])
    return (
        y,
        start,
        rows.integers(entries[INDICES], count),
        rows.doubles(entries[DATA], count),
        rows.doubles(entries[SPHERES], entries[BLOCKS] * MANIFOLD * lanes.LANES),
        rows.doubles(entries[WORK], SIZE * lanes.LANES),
    )


@kernels.local_kernel
def project_vertices(y_place, p_place, record):
    """Write projections p (m, 3) of the m elements that ``record`` lists; arguments: addresses."""
    y, start, indices, data, manifold, work = _arguments(y_place, record)
    entries = rows.indices(record, ARRAYS)
    count = entries[COUNT]
    elements = rows.indices(entries[SAMPLED], count)
    taken = rows.doubles(entries[TAKEN], MANIFOLD * lanes.LANES)
    p = rows.doubles(p_place, 3 * count)
    for begin in range(0, count, lanes.LANES):
        for lane in range(lanes.LANES):
            e = elements[min(begin + lane, count - 1)]
            lanes.save(
                work, H, lane, arithmetic.first_three(_curvature(y, e, start, indices, data))
            )
        lanes.take(manifold, MANIFOLD, elements, begin, taken)
        _half_spheres(work, taken, 0)
        store_projections(work, 1, begin, p, P)
    return 0.0


@kernels.local_kernel
def accumulate_vertices(y_place, rhs_place, record):
    """Add S^T W p of all elements to the right-hand side; return the energy, J.

    ``y_place``, ``rhs_place``, ``record`` are addresses of positions, right-hand side and record.
    """
    entries = rows.indices(record, ARRAYS)
    y, start, indices, data, manifold, work = _arguments(y_place, record)
    rhs, elements = rows.doubles(rhs_place, WIDTH * entries[VERTICES]), entries[ELEMENTS]
    energy = 0.0
    for block in range(entries[BLOCKS]):
        begin = block * lanes.LANES
        used = min(lanes.LANES, elements - begin)
        for lane in range(0, used, WIDTH):
            e, last = begin + lane, elements - 1
            hx, hy, hz, _ = arithmetic.transposed(
                _curvature(y, e, start, indices, data),
                _curvature(y, min(e + 1, last), start, indices, data),
                _curvature(y, min(e + 2, last), start, indices, data),
                _curvature(y, min(e + 3, last), start, indices, data),
            )
            place = H * lanes.LANES + lane
            rows.store(work, place, hx)
            rows.store(work, place + lanes.LANES, hy)
            rows.store(work, place + 2 * lanes.LANES, hz)
        _half_spheres(work, manifold, block)
        for lane in range(used):
            w = at(manifold, (block * MANIFOLD + WEIGHT) * lanes.LANES + lane)
            h, p = lanes.load(work, H, lane), lanes.load(work, P, lane)
            energy += w * lanes.square_distance(h, p)
            force = arithmetic.of_three(w * p[0], w * p[1], w * p[2])
            for k in range(at(start, begin + lane), at(start, begin + lane + 1)):
                v = WIDTH * at(indices, k)
                rows.store(rhs, v, arithmetic.add_scaled(rows.load(rhs, v), at(data, k), force))
    return 0.5 * energy


@kernels.gradient_kernel
def project_gradients(d_place, manifold_place, p_place, m):
    """Project the curvature vectors S q (m, 3) onto half spheres (`VertexBending`): write p (m, 3).

    The first three arguments are addresses of S q, of the numbers from `lanes.pack`, and of p.
    """
    d, p = rows.doubles(d_place, 3 * m), rows.doubles(p_place, 3 * m)
    blocks = (m + lanes.LANES - 1) // lanes.LANES
    manifold = rows.doubles(manifold_place, blocks * MANIFOLD * lanes.LANES)
    work = np.zeros(SIZE * lanes.LANES)
    for block in range(blocks):
        copy_rows(d, 1, block * lanes.LANES, work, H)
        _half_spheres(work, manifold, block)
        store_projections(work, 1, block * lanes.LANES, p, P)


def interior_vertices(triangles: np.ndarray, vertices: int) -> np.ndarray:
    """Return the indices (n,) of vertices on no boundary edge of ``triangles`` (T, 3)."""
    inside = np.ones(vertices, dtype=bool)
    inside[boundary_edges(triangles)] = False
    return np.flatnonzero(inside)


def cotangent_laplacian(points: np.ndarray, triangles: np.ndarray) -> sparse.csr_array:
    """Return the cotangent Laplacian L, (N, N) CSR (Pinkall and Polthier 1993).

    (L q)_v = sum_j (cot a_j + cot b_j)(q_v - q_j) with the angles a_j, b_j opposite to edge (v, j).
    ``points`` are (N, 3) m, ``triangles`` (T, 3).
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
    """Return (start, fan): indices of triangles at vertex v are fan[start[v]:start[v + 1]]."""
    order = np.argsort(triangles.ravel(), kind="stable")
    counts = np.bincount(triangles.ravel(), minlength=vertices)
    start = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return start, (order // 3).astype(np.int64)


@lanes.lane_function
def _sides(q, triangle):
    """Return the two edge vectors of ``triangle`` from its first corner."""
    a, b, c = triangle[0], triangle[1], triangle[2]
    return (
        (q[b, 0] - q[a, 0], q[b, 1] - q[a, 1], q[b, 2] - q[a, 2]),
        (q[c, 0] - q[a, 0], q[c, 1] - q[a, 1], q[c, 2] - q[a, 2]),
    )


@compiled(nogil=True)
def fan_normals(q, vertices, elements, start, fan, triangles, normals):
    """Write area-weighted unit normals at the vertices of ``elements`` to ``normals``.

    The normal is zero if the triangles around the vertex have no area.

    q : (N, 3) positions
    vertices : (m,) vertex of each element
    elements : indices of the elements whose row of ``normals`` (m, 3) is written
    start, fan : the triangles at vertex v are ``fan[start[v]:start[v + 1]]``
    triangles : (T, 3) vertex indices
    """
    for i in elements:
        first, last = start[vertices[i]], start[vertices[i] + 1]
        largest = 0.0
        for k in range(first, last):
            u, v = _sides(q, triangles[fan[k]])
            largest = max(largest, lanes.absolute_sum(u), lanes.absolute_sum(v))
        # scale by a power of two, without rounding: products neither overflow nor underflow
        power = 2.0 ** min(-math.frexp(largest)[1], 1000)
        nx, ny, nz = 0.0, 0.0, 0.0
        for k in range(first, last):
            u, v = _sides(q, triangles[fan[k]])
            x, y, z = lanes.cross(lanes.scaled(power, u), lanes.scaled(power, v))
            nx, ny, nz = nx + x, ny + y, nz + z
        scale = lanes.absolute_sum((nx, ny, nz))
        if scale > 0.0:
            unit = lanes.scaled(1.0 / (scale + lanes.SMALLEST), (nx, ny, nz))
            nx, ny, nz = lanes.scaled(1.0 / np.sqrt(lanes.dot(unit, unit)), unit)
        normals[i, 0], normals[i, 1], normals[i, 2] = nx, ny, nz


# A vertex counts as flat if its rest curvature |S q| is at most this fraction of || |S| |q| ||.
FLAT = 1e-9


class VertexBending(ConstraintGroup):
    """One constraint per interior vertex, weight w A_v (barycentric area).

    S q is the mean-curvature vector H(q) = 1/(2 A_v) sum_j (cot a_j + cot b_j)(q_v - q_j). Its rest
    value has the magnitude m and lies on side s = +1 or -1 of the surface. p is the point nearest
    to H on the half sphere { |p| = m, s p.n >= 0 }. The vertex normal n is that at the beginning of
    the frame: the half sphere is fixed during iterations, so that the objective cannot rise. If
    s H.n < 0, p is on the rim of the half sphere and pulls the vertex back, so that it does not
    flip. A flat rest shape has m = 0 up to rounding errors and s = 0. If H = 0, p is the pole
    m s n; if the triangles around the vertex also have no area, p is the rest value of H.
    """

    class Config(GroupConfig):
        """Weight w per area, and the fields of `GroupConfig`."""

        effect: Literal["bending"] = "bending"

    cells = "vertex"
    unit = "1/m"
    rows_per_element = 1
    frame_lagged = True
    manifold = "half sphere"
    gradient_kernel = project_gradients

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._triangles = require_cells(mesh, "triangles", self.name)
        self.vertices = interior_vertices(self._triangles, mesh.vertices)
        if len(self.vertices) == 0:
            raise SceneError(f"effect '{self.name}' needs interior vertices, this mesh has none")
        area = barycentric_areas(mesh.points, self._triangles)[self.vertices]
        self.weights = self.element_weights(mesh) * area
        laplacian = cotangent_laplacian(mesh.points, self._triangles)[self.vertices]
        self.S = sparse.csr_array(laplacian.multiply(0.5 / area[:, None]))
        self.S.sort_indices()
        points = mesh.points
        curvature = self.rest = self.S @ points
        self.magnitude = np.linalg.norm(curvature, axis=1)
        cancelling = np.linalg.norm(abs(self.S) @ np.abs(points), axis=1)
        normals = np.zeros_like(curvature)
        self._fan_start, self._fan = fans = vertex_fans(self._triangles, len(points))
        every = np.arange(self.elements)
        fan_normals(points, self.vertices, every, *fans, self._triangles, normals)
        side = np.sign(np.einsum("ij,ij->i", curvature, normals))
        self.side = np.where(self.magnitude > FLAT * cancelling, side, 0.0)
        self._curved = np.flatnonzero(self.side)
        self.normals = normals
        self._set_kernel()

    @classmethod
    def element_vertices(cls, mesh: Mesh) -> np.ndarray:
        return interior_vertices(mesh.triangles, mesh.vertices)[:, None]

    def begin_frame(self, q: np.ndarray, elements: np.ndarray | None = None) -> None:
        """Compute normals at ``q`` (N, 3) m for those ``elements`` (None: all) not flat at rest."""
        self._require_frame()
        curved = self._curved
        if elements is not None:
            curved = elements[self.side[elements] != 0.0]
        if len(curved) == 0:
            return
        fans = (self._fan_start, self._fan, self._triangles)
        fan_normals(q, self.vertices, curved, *fans, self.normals)
        put_poles(self._manifold, curved, self.side, self.normals)

    def for_run(self) -> Self:
        own = copy(self)
        own.normals, own._manifold = self.normals.copy(), rows.copied(self._manifold)
        return super(VertexBending, own).for_run()

    def sampler(self, elements: np.ndarray) -> LocalKernel:
        self._require_frame()
        return self._kernel(project_vertices, elements)

    def _accumulator(self) -> LocalKernel:
        return self._kernel(accumulate_vertices, np.empty(0, np.int64))

    def _kernel(self, function: Any, elements: np.ndarray) -> LocalKernel:
        """Return a `LocalKernel` with a ``function`` that either writes the projections of
        ``elements`` or adds the forces of all elements."""
        operator = self.S.indptr, self.S.indices, self.S.data
        memory = lanes.workspace(SIZE), elements, lanes.workspace(MANIFOLD)
        arrays = (*operator, self._manifold, *memory)
        numbers = lanes.blocks(self.elements), self.elements, len(elements)
        return LocalKernel(function, self.S.shape[1], arrays, numbers)

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
        part._set_kernel()
        return part.for_run(), vertices

    def _set_kernel(self) -> None:
        self.S.indptr = self.S.indptr.astype(np.int32)
        self.S.indices = self.S.indices.astype(np.int32)
        numbers = (self.weights, self.magnitude, self.rest, self.side[:, None] * self.normals)
        self._manifold = lanes.pack(np.column_stack(numbers))
        self.normals.flags.writeable = self._manifold.flags.writeable = False

    def kernel_parameters(self) -> np.ndarray:
        return self._manifold

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        h, n = d[:, 0], self.normals[elements] * self.side[elements, None]
        direction, length = directions(h)
        height = np.einsum("ij,ij->i", direction, n)[:, None]
        rim, rim_length = directions(direction - height * n)
        again, left = directions(rim - np.einsum("ij,ij->i", rim, n)[:, None] * n)
        again = np.where((rim_length > RIM) & (left > 0.5), again, _crossing(n))
        rim = np.where(rim_length > NEAR_POLE, rim, again)
        unit = np.where((height < 0.0) & (n != 0.0).any(axis=1)[:, None], rim, direction)
        unit = np.where(length > 0.0, unit, n)
        p = unit * self.magnitude[elements, None]
        return np.where((unit != 0.0).any(axis=1)[:, None], p, self.rest[elements])[:, None, :]


def _crossing(n: np.ndarray) -> np.ndarray:
    """Return for each row of n a unit vector orthogonal to it; equal rows give equal vectors."""
    k = np.argmin(np.abs(n), axis=1)
    i, j = (k + 1) % 3, (k + 2) % 3
    rows = np.arange(len(n))
    out = np.zeros_like(n)
    out[rows, i], out[rows, j] = n[rows, j], -n[rows, i]
    length = np.linalg.norm(out, axis=1, keepdims=True)
    return out / np.where(length > 0.0, length, 1.0)
