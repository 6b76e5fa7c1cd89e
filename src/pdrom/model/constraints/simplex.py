"""Groups on simplices: springs (1 row), triangles (2 rows), tetrahedra (3 rows).

An element with p rows has p + 1 vertices, S q = D^-T [q_1 - q_0, ..., q_p - q_0]^T with the edge
matrix D of the rest shape (1 for springs). What differs from group to group is the projection of a
block; gather and scatter are here, for blocks of elements (see `pdrom.model.constraints.lanes`).
"""

from collections.abc import Callable

import numpy as np

from pdrom.model.constraints.base import StencilGroup
from pdrom.model.constraints.lanes import (
    LANES,
    blocks,
    lane_function,
    load,
    pack,
    save,
    workspace,
)
from pdrom.model.constraints.parts import Parts

# numbers of a lane in the working array: edges, S q, p, forces on the corners but 0, energy
EDGE, F, P, FORCE, ENERGY, OWN = 0, 9, 18, 27, 36, 37
# number of a lane in the packed geometry, before the operator and what else a group has
WEIGHT, OPERATOR = 0, 1


class SimplexGroup(StencilGroup):
    """A group whose kernels work on packed blocks.

    A subclass gives two kernels and, if it has other numbers of an element, `_extra`:

    accumulate_kernel : ``(y, corners, geometry, *constants, first, last, elements, work, rhs)``
        adds the blocks first .. last - 1 to rhs and returns their energy
    project_kernel : ``(y, corners, geometry, *constants, elements, taken_corners, taken_geometry,
        work, p)`` writes the projections of some elements
    """

    accumulate_kernel: Callable[..., float]
    project_kernel: Callable[..., None]

    work_size = OWN
    """Numbers of a lane in the working array."""

    def _assemble(self, vertices: int) -> None:
        super()._assemble(vertices)
        e, m = self.stencil.shape
        self._corners = pack(np.asarray(self.stencil, dtype=np.int32))
        numbers = np.column_stack([self.weights, *self._extra()])
        self._geometry = pack(numbers)
        # the copies that fill up the last block have no energy
        by_lane = self._geometry.reshape(blocks(e), numbers.shape[1], LANES)
        by_lane[-1:, WEIGHT, e - LANES * (blocks(e) - 1) :] = 0.0
        self._work = [workspace(self.work_size) for _ in range(2)]
        self._taken = (np.empty(m * LANES, np.int32), workspace(numbers.shape[1]))
        self._parts = Parts(
            blocks(e), e >= self.split_from, vertices, lambda block: self.stencil[block * LANES :]
        )

    def _extra(self) -> list[np.ndarray]:
        """Numbers of an element after its weight: the operator without the corner 0."""
        return [self.operator[:, :, 1:].reshape(self.elements, self.rows_per_element**2)]

    def _constants(self) -> tuple[float, ...]:
        """Further arguments of the kernels."""
        return ()

    def project_elements(self, y: np.ndarray, elements: np.ndarray) -> np.ndarray:
        p = np.empty((self.rows_per_element * len(elements), 3))
        data = (self._corners, self._geometry, *self._constants())
        self.project_kernel(y, *data, elements, *self._taken, self._work[0], p)
        return p

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        data = (self._corners, self._geometry, *self._constants())

        def kernel(first: int, last: int, part: int, target: np.ndarray) -> float:
            work = self._work[part]
            return self.accumulate_kernel(y, *data, first, last, self.elements, work, target)

        return self._parts.accumulate(kernel, rhs, self.threads)


@lane_function
def gather_edges(y, corners, block, rows, work):
    """Edges from corner 0 to the others."""
    for lane in range(LANES):
        base = block * (rows + 1) * LANES + lane
        v0 = corners[base]
        for i in range(rows):
            v = corners[base + (i + 1) * LANES]
            edge = (y[v, 0] - y[v0, 0], y[v, 1] - y[v0, 1], y[v, 2] - y[v0, 2])
            save(work, EDGE + 3 * i, lane, edge)


@lane_function
def copy_rows(d, rows, start, work, first):
    """Copy S q (m rows, 3) of the elements ``start``, ... of m, the last one repeated."""
    count = d.shape[0] // rows
    for lane in range(LANES):
        base = rows * min(start + lane, count - 1)
        for i in range(rows):
            save(work, first + 3 * i, lane, (d[base + i, 0], d[base + i, 1], d[base + i, 2]))


@lane_function
def scatter(work, corners, block, rows, elements, rhs):
    """Add the forces of a block, of ``elements`` in all, to the vertices.

    Forces on the corners 1, 2, ... are given; corner 0 gets what makes their sum zero.
    """
    for lane in range(min(LANES, elements - block * LANES)):
        base = block * (rows + 1) * LANES + lane
        x, y, z = 0.0, 0.0, 0.0
        for i in range(rows):
            v = corners[base + (i + 1) * LANES]
            fx, fy, fz = load(work, FORCE + 3 * i, lane)
            rhs[v, 0] += fx
            rhs[v, 1] += fy
            rhs[v, 2] += fz
            x, y, z = x + fx, y + fy, z + fz
        v = corners[base]
        rhs[v, 0] -= x
        rhs[v, 1] -= y
        rhs[v, 2] -= z


@lane_function
def start_energy(work):
    """Set the sums of w |S q - p|^2 to zero."""
    for lane in range(LANES):
        work[ENERGY * LANES + lane] = 0.0


@lane_function
def energy(work):
    """Energy of all blocks since `start_energy`."""
    total = 0.0
    for lane in range(LANES):
        total += work[ENERGY * LANES + lane]
    return 0.5 * total


@lane_function
def store_projections(work, rows, start, p):
    """Copy the projections of a block to those of the elements ``start``, ``start + 1``, ..."""
    for lane in range(min(LANES, p.shape[0] // rows - start)):
        for i in range(rows):
            row = rows * (start + lane) + i
            p[row, 0], p[row, 1], p[row, 2] = load(work, P + 3 * i, lane)
