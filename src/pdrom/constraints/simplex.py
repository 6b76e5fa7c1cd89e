"""Groups on simplices: springs (1 row), triangles (2 rows), tetrahedra (3 rows).

An element with p rows has p + 1 vertices, S q = D^-T [q_1 - q_0, ..., q_p - q_0]^T with the edge
matrix D of the rest shape. What differs from group to group is the projection of a block; gather,
weighting and scatter are here, for blocks of elements (see `pdrom.constraints.lanes`).
"""

from collections.abc import Callable

import numpy as np

from pdrom.constraints.base import StencilGroup
from pdrom.constraints.lanes import (
    LANES,
    blocks,
    lane_function,
    load,
    mix3,
    pack,
    save,
    workspace,
)
from pdrom.constraints.parts import Parts

# numbers of a lane in the working array: edges, S q, p, forces on the corners, energy
EDGE, F, P, FORCE, ENERGY, OWN = 0, 9, 18, 27, 39, 40
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
        self._numbers = np.column_stack([self.weights, *self._extra()])
        self._geometry = pack(self._numbers)
        self._work = [workspace(self.work_size) for _ in range(2)]
        self._taken = (np.empty(m * LANES, np.int32), workspace(self._numbers.shape[1]))
        self._parts = Parts(
            blocks(e), e >= self.split_from, vertices, lambda block: self.stencil[block * LANES :]
        )

    def _extra(self) -> list[np.ndarray]:
        """Numbers of an element after its weight: the operator without the corner 0."""
        return [self.operator[:, :, 1:].reshape(self.elements, -1)]

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
        x, y_, z = y[v0, 0], y[v0, 1], y[v0, 2]
        for i in range(rows):
            v = corners[base + (i + 1) * LANES]
            save(work, EDGE + 3 * i, lane, (y[v, 0] - x, y[v, 1] - y_, y[v, 2] - z))


@lane_function
def store_forces(work, lane, first, second, third):
    """Forces on the corners 1, 2 and 3; corner 0 gets what makes their sum zero."""
    save(work, FORCE, lane, mix3(-1.0, first, -1.0, second, -1.0, third))
    save(work, FORCE + 3, lane, first)
    save(work, FORCE + 6, lane, second)
    save(work, FORCE + 9, lane, third)


@lane_function
def scatter(work, corners, block, rows, elements, rhs):
    """Add the forces of a block, of ``elements`` in all, to the vertices; its energy, twice."""
    energy = 0.0
    for lane in range(min(LANES, elements - block * LANES)):
        base = block * (rows + 1) * LANES + lane
        for i in range(rows + 1):
            v = corners[base + i * LANES]
            force = load(work, FORCE + 3 * i, lane)
            rhs[v, 0] += force[0]
            rhs[v, 1] += force[1]
            rhs[v, 2] += force[2]
        energy += work[ENERGY * LANES + lane]
    return energy


@lane_function
def store_projections(work, rows, start, p):
    """Copy the projections of a block to those of the elements ``start``, ``start + 1``, ..."""
    for lane in range(min(LANES, p.shape[0] // rows - start)):
        for i in range(rows):
            row = rows * (start + lane) + i
            p[row, 0], p[row, 1], p[row, 2] = load(work, P + 3 * i, lane)
