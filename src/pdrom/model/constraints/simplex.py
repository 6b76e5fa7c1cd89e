"""Groups on simplices: springs (1 row), triangles (2 rows), tetrahedra (3 rows).

An element with p rows has p + 1 vertices, S q = D^-T [q_1 - q_0, ..., q_p - q_0]^T with the edge
matrix D of the rest shape (1 for springs). This module reads positions and adds forces of blocks of
elements (see `pdrom.model.constraints.lanes`); the groups differ in the projection of a block.

If one element of a block needs a slower formula, the whole block computes it. Blocks of neighbours
are fast, because neighbours are in similar states and share vertices in the cache. Mesh files often
list neighbours at distant places, so that kernels may visit the elements in another order. The
public arrays of a group (S, weights, projections) keep the order of the mesh.
"""

from typing import Any, ClassVar

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from pdrom.model.compiled import rows
from pdrom.model.compiled.arithmetic import add, constant, subtract, transposed
from pdrom.model.compiled.rows import WIDTH, at
from pdrom.model.constraints.base import StencilGroup
from pdrom.model.constraints.lanes import LANES, blocks, lane_function, load, pack, save, workspace
from pdrom.model.constraints.local_kernel import OWN, VERTICES, LocalKernel

# offsets in the working array: edges, S q, p, forces on all corners except corner 0, energy
EDGE, F, P, FORCE, ENERGY, SIZE = 0, 9, 18, 27, 36, 37
# offsets in the packed geometry: weight, then the operator or other numbers of an element
WEIGHT, OPERATOR = 0, 1
# Indices into a kernel's record: number of blocks, size of the working array, number of elements to
# project; addresses of corners, geometry, constants, working array, elements to project, memory for
# a block's corners and memory for its geometry.
BLOCKS, WORK_SIZE, COUNT, CORNERS, GEOMETRY, CONSTANTS, WORK = range(OWN, OWN + 7)
ELEMENTS, TAKEN, TAKEN_GEOMETRY, ARRAYS = range(OWN + 7, OWN + 11)


class SimplexGroup(StencilGroup):
    """A group of simplices whose kernels work on packed blocks of elements.

    A subclass sets two kernels. It overrides `_extra` if they do not read the operator S_e.

    accumulate_kernel : `pdrom.model.constraints.local_kernel.local_kernel` that adds blocks' forces
    project_kernel : local kernel that writes projections of the sampled elements (see `ELEMENTS`)
    """

    accumulate_kernel: Any
    project_kernel: Any

    work_size = SIZE
    """Number of values per lane in the working array."""
    allowed: Any = ()
    """Constants of the kernels, such as the allowed range of singular values."""
    _own_arrays: tuple[np.ndarray, ...] = ()
    """Further arrays whose addresses are appended to the record of the kernels."""
    _own_memory = 0
    """Size of an array of working memory whose address comes last in the record."""
    reordered: ClassVar[bool] = True
    """Whether the kernels may visit the elements in an order different from the mesh."""

    def _assemble(self, vertices: int) -> None:
        super()._assemble(vertices)
        e = len(self.stencil)
        self._order = visiting_order(self.stencil, vertices) if self.reordered else None
        self._corners = pack(self._visited(np.asarray(self.stencil, dtype=np.int32)))
        numbers = self._visited(np.column_stack([self.weights, *self._extra()]))
        self._geometry, self._numbers = pack(numbers), numbers.shape[1]
        # copies of the last element fill up its block: with weight 0 they add no force or energy
        by_lane = self._geometry.reshape(blocks(e), self._numbers, LANES)
        by_lane[-1:, WEIGHT, e - LANES * (blocks(e) - 1) :] = 0.0
        self._corners.flags.writeable = self._geometry.flags.writeable = False

    def _accumulator(self) -> LocalKernel:
        return self._kernel(self.accumulate_kernel, np.empty(0, np.int64))

    def _visited(self, values: np.ndarray) -> np.ndarray:
        """Return the values (e, ...) of all elements in the order in which kernels visit them."""
        return values if self._order is None else values[self._order]

    def sampler(self, elements: np.ndarray) -> LocalKernel:
        places = elements if self._order is None else np.argsort(self._order)[elements]
        return self._kernel(self.project_kernel, places)

    def _kernel(self, function: Any, elements: np.ndarray) -> LocalKernel:
        """Return a `LocalKernel` with a ``function`` that either writes the projections of
        ``elements`` or adds the forces of all elements."""
        work = workspace(self.work_size)
        data = (self._corners, self._geometry, np.array(self.allowed), work, elements)
        corners = np.empty(self.stencil.shape[1] * LANES, np.int32)
        memory = corners, rows.zeros(LANES * self._numbers)
        arrays = (*data, *memory, *self._own_arrays, np.empty(self._own_memory))
        numbers = blocks(self.elements), len(work), len(elements)
        return LocalKernel(function, self.S.shape[1], arrays, numbers)

    def _extra(self) -> list[np.ndarray]:
        """Return arrays (e, numbers) to pack after the weights: operators S_e without column 0."""
        return [self.operator[:, :, 1:].reshape(self.elements, self.rows_per_element**2)]


@lane_function
def arguments(y, rhs, record, corners, numbers):
    """Return arrays y, rhs, corners, geometry, constants, work, and the number of blocks.

    ``y``, ``rhs`` and ``record`` are the addresses that a `local_kernel` gets. An element has
    ``corners`` vertices and ``numbers`` packed numbers.
    """
    entries = rows.indices(record, ARRAYS)
    count = WIDTH * entries[VERTICES]
    packed = entries[BLOCKS] * LANES
    return (
        rows.doubles(y, count),
        rows.doubles(rhs, count),
        rows.integers(entries[CORNERS], packed * corners),
        rows.doubles(entries[GEOMETRY], packed * numbers),
        rows.doubles(entries[CONSTANTS], 2),
        rows.doubles(entries[WORK], entries[WORK_SIZE]),
        entries[BLOCKS],
    )


@lane_function
def samples(record, corners, numbers):
    """Return three arrays of ``record``: elements to project, and working arrays for a block.

    `pdrom.model.constraints.lanes.take` writes to these the ``corners`` vertices and the
    ``numbers`` packed numbers (weight, operator, rest shape) of each element of the block.
    """
    entries = rows.indices(record, ARRAYS)
    return (
        rows.indices(entries[ELEMENTS], entries[COUNT]),
        rows.integers(entries[TAKEN], corners * LANES),
        rows.doubles(entries[TAKEN_GEOMETRY], numbers * LANES),
    )


@lane_function
def corner_rows(y, corners, place):
    """Return the rows of ``y`` (positions) of the vertices ``corners[place:place + 4]``."""
    return (
        rows.load(y, WIDTH * at(corners, place)),
        rows.load(y, WIDTH * at(corners, place + 1)),
        rows.load(y, WIDTH * at(corners, place + 2)),
        rows.load(y, WIDTH * at(corners, place + 3)),
    )


@lane_function
def edge_columns(start, end):
    """Return four rows: x, y, z and padding of four edges from vertices ``start`` to ``end``."""
    return transposed(
        subtract(end[0], start[0]),
        subtract(end[1], start[1]),
        subtract(end[2], start[2]),
        subtract(end[3], start[3]),
    )


@lane_function
def gather_edges(y, corners, block, edges, work):
    """Write the edges from corner 0 to corners 1, ..., ``edges`` of a ``block`` to ``work``."""
    for lane in range(0, LANES, WIDTH):
        base = block * (edges + 1) * LANES + lane
        start = corner_rows(y, corners, base)
        for i in range(edges):
            end = corner_rows(y, corners, base + (i + 1) * LANES)
            ex, ey, ez, _ = edge_columns(start, end)
            place = (EDGE + 3 * i) * LANES + lane
            rows.store(work, place, ex)
            rows.store(work, place + LANES, ey)
            rows.store(work, place + 2 * LANES, ez)


@lane_function
def copy_rows(d, count, start, work, first):
    """Copy a block of S q to ``work`` at offset ``first``: the elements from ``start`` on of the
    flat array ``d``, in which each of m elements has ``count`` rows of three numbers."""
    last = len(d) // (3 * count) - 1
    for lane in range(LANES):
        base = count * min(start + lane, last)
        for i in range(count):
            k = 3 * (base + i)
            save(work, first + 3 * i, lane, (d[k], d[k + 1], d[k + 2]))


@lane_function
def add_to(rhs, corners, place, forces):
    """Add four ``forces`` to ``rhs`` at ``corners[place:place + 4]``; a corner may occur twice."""
    for lane in range(WIDTH):
        v = WIDTH * at(corners, place + lane)
        rows.store(rhs, v, add(rows.load(rhs, v), forces[lane]))


@lane_function
def take_from(rhs, corners, place, forces):
    """Subtract four ``forces`` from ``rhs`` at ``corners[place:place + 4]``; corners may repeat."""
    for lane in range(WIDTH):
        v = WIDTH * at(corners, place + lane)
        rows.store(rhs, v, subtract(rows.load(rhs, v), forces[lane]))


@lane_function
def scatter(work, corners, block, edges, rhs):
    """Add the forces of a block, in ``work``, to ``rhs``, a flat array of rows of four numbers.

    ``work`` has the forces on corners 1, ..., ``edges``; corner 0 gets minus their sum.
    """
    none = constant(0.0)
    for lane in range(0, LANES, WIDTH):
        base = block * (edges + 1) * LANES + lane
        x, y, z = none, none, none
        for i in range(edges):
            place = (FORCE + 3 * i) * LANES + lane
            fx = rows.load(work, place)
            fy = rows.load(work, place + LANES)
            fz = rows.load(work, place + 2 * LANES)
            add_to(rhs, corners, base + (i + 1) * LANES, transposed(fx, fy, fz, none))
            x, y, z = add(x, fx), add(y, fy), add(z, fz)
        take_from(rhs, corners, base, transposed(x, y, z, none))


@lane_function
def store_projections(work, count, start, p, first=P):
    """Copy the projections of a block, at offset ``first`` of ``work``, to the flat array ``p``
    from element ``start`` on; each element has ``count`` rows of three numbers."""
    for lane in range(min(LANES, len(p) // (3 * count) - start)):
        for i in range(count):
            at_p = 3 * (count * (start + lane) + i)
            p[at_p], p[at_p + 1], p[at_p + 2] = load(work, first + 3 * i, lane)


# Kernels visit elements in mesh order if blocks of `LANES` elements then have at most KEPT times
# as many vertices as blocks in the order of `visiting_order`, which is true of grids.
KEPT = 1.5


def visiting_order(stencil: np.ndarray, vertices: int) -> np.ndarray | None:
    """Return element indices (e,) in the order of visits; None for the order of the mesh.

    Elements are sorted by their vertices, which the reverse Cuthill-McKee algorithm (Cuthill and
    McKee 1969) numbers such that neighbours have similar numbers.

    stencil : (e, m) vertices of each element
    vertices : number of all vertices
    """
    if len(stencil) == 0:
        return None
    e, m = stencil.shape
    places = (np.repeat(np.arange(e), m), stencil.ravel())
    incidence = sparse.csr_array((np.ones(e * m), places), shape=(e, vertices))
    neighbours = sparse.csr_array(incidence.T @ incidence)  # vertices that share an element
    rank = np.empty(vertices, dtype=np.int64)
    rank[csgraph.reverse_cuthill_mckee(neighbours, True)] = np.arange(vertices)
    order = np.lexsort(np.sort(rank[stencil], axis=1).T[::-1])
    return order if _corners(stencil) > KEPT * _corners(stencil[order]) else None


def _corners(stencil: np.ndarray) -> int:
    """Return the number of distinct vertices of a block, summed over all blocks."""
    blocks = np.arange(len(stencil)) // LANES
    pairs = blocks[:, None] * (int(stencil.max()) + 1) + stencil
    return len(np.unique(pairs))
