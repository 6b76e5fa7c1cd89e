"""Groups on simplices: springs (1 row), triangles (2 rows), tetrahedra (3 rows).

An element with p rows has p + 1 vertices, S q = D^-T [q_1 - q_0, ..., q_p - q_0]^T with the edge
matrix D of the rest shape (1 for springs). What differs from group to group is the projection of a
block; gather and scatter are here, for blocks of elements (see `pdrom.model.constraints.lanes`).

A block takes the expensive path as soon as one of its elements needs it. Neighbours are in like
states, so that blocks of neighbours are cheap where little happens; their vertices are also in the
cache still. Meshers list elements in the order in which they were made, neighbours far apart. What
a group shows to others (S, weights, projections) keeps the order of the mesh; only the arrays of
its kernels do not.
"""

from typing import Any, ClassVar

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from pdrom.model.compiled import rows
from pdrom.model.compiled.arithmetic import add, constant, subtract, transposed
from pdrom.model.compiled.rows import WIDTH, at
from pdrom.model.constraints.base import StencilGroup
from pdrom.model.constraints.lanes import LANES, blocks, lane_function, load, pack, save, workspaces
from pdrom.model.constraints.local_kernel import FIRST, OWN, VERTICES, LocalKernel

# numbers of a lane in the working array: edges, S q, p, forces on the corners but 0, energy
EDGE, F, P, FORCE, ENERGY, SIZE = 0, 9, 18, 27, 36, 37
# number of a lane in the packed geometry, before the operator and what else a group has
WEIGHT, OPERATOR = 0, 1
# Entries of the record: the size of a working array and the number of elements to project; then the
# places of corners, geometry, constants, working arrays, the elements to project and their data.
WORK_SIZE, COUNT, CORNERS, GEOMETRY, CONSTANTS, WORK, ELEMENTS = range(OWN, OWN + 7)
TAKEN, TAKEN_GEOMETRY, ARRAYS = range(OWN + 7, OWN + 10)


class SimplexGroup(StencilGroup):
    """A group whose kernels work on packed blocks.

    A subclass gives two kernels and, if it has other numbers of an element, `_extra`:

    accumulate_kernel : a `pdrom.model.constraints.local_kernel.local_kernel` whose units are blocks
    project_kernel : the same form; writes the projections of some elements, see `samples`
    """

    accumulate_kernel: Any
    project_kernel: Any

    work_size = SIZE
    """Numbers of a lane in the working array."""
    allowed: Any = ()
    """Further numbers that the kernels need."""
    _own_arrays: tuple[np.ndarray, ...] = ()
    """Further arrays of the kernels."""
    reordered: ClassVar[bool] = True
    """Whether the kernel may visit the elements in another order than that of the mesh."""

    def _assemble(self, vertices: int) -> None:
        super()._assemble(vertices)
        e, m = self.stencil.shape
        self._order = visiting_order(self.stencil, vertices) if self.reordered else None
        visited = self._visited(np.asarray(self.stencil, dtype=np.int32))
        self._corners = pack(visited)
        numbers = self._visited(np.column_stack([self.weights, *self._extra()]))
        self._geometry = pack(numbers)
        # the copies that fill up the last block have no force and no energy
        by_lane = self._geometry.reshape(blocks(e), numbers.shape[1], LANES)
        by_lane[-1:, WEIGHT, e - LANES * (blocks(e) - 1) :] = 0.0
        self._work = workspaces(self.work_size)
        self._taken = (np.empty(m * LANES, np.int32), rows.zeros(LANES * numbers.shape[1]))
        self.local_kernel = LocalKernel(
            self.accumulate_kernel,
            vertices,
            blocks(e),
            arrays=self._arrays(np.empty(0, np.int64)),
            numbers=(self._work.shape[1], 0),
            touched=(lambda block: visited[block * LANES :]) if e >= self.split_from else None,
        )

    def _visited(self, values: np.ndarray) -> np.ndarray:
        """Values (e, ...) of the elements in the order in which the kernel visits them."""
        return values if self._order is None else values[self._order]

    def sampler(self, elements: np.ndarray) -> LocalKernel:
        places = elements if self._order is None else np.argsort(self._order)[elements]
        return LocalKernel(
            self.project_kernel,
            self.S.shape[1],
            blocks(self.elements),
            arrays=self._arrays(places),
            numbers=(self._work.shape[1], len(elements)),
        )

    def _arrays(self, elements: np.ndarray) -> tuple[np.ndarray, ...]:
        data = (self._corners, self._geometry, np.array(self.allowed), self._work)
        return (*data, elements, *self._taken, *self._own_arrays)

    def _extra(self) -> list[np.ndarray]:
        """Numbers of an element after its weight: the operator without the corner 0."""
        return [self.operator[:, :, 1:].reshape(self.elements, self.rows_per_element**2)]


@lane_function
def arguments(y, rhs, record, part, corners, numbers):
    """Unpack the record of a kernel whose elements have so many corners and numbers.

    Addresses ``y``, ``rhs``, ``record`` and ``part`` as in `local_kernel`, to
    (y, rhs, corners, geometry, constants, work, first block, last block)
    """
    entries = rows.indices(record, ARRAYS)
    count = WIDTH * entries[VERTICES]
    packed = entries[FIRST + 2] * LANES
    size = entries[WORK_SIZE]
    return (
        rows.doubles(y, count),
        rows.doubles(rhs, count),
        rows.integers(entries[CORNERS], packed * corners),
        rows.doubles(entries[GEOMETRY], packed * numbers),
        rows.doubles(entries[CONSTANTS], 2),
        rows.doubles(entries[WORK] + 8 * size * part, size),
        entries[FIRST + part],
        entries[FIRST + part + 1],
    )


@lane_function
def samples(record, corners, numbers):
    """Unpack from ``record`` what a kernel that projects some elements needs besides `arguments`.

    (elements, corners and geometry of a block of them, see `pdrom.model.constraints.lanes.take`),
    for so many ``corners`` and ``numbers`` an element
    """
    entries = rows.indices(record, ARRAYS)
    return (
        rows.indices(entries[ELEMENTS], entries[COUNT]),
        rows.integers(entries[TAKEN], corners * LANES),
        rows.doubles(entries[TAKEN_GEOMETRY], numbers * LANES),
    )


@lane_function
def corner_rows(y, corners, place):
    """Positions in ``y`` of the vertices ``corners[place:place + 4]``, as rows."""
    return (
        rows.load(y, WIDTH * at(corners, place)),
        rows.load(y, WIDTH * at(corners, place + 1)),
        rows.load(y, WIDTH * at(corners, place + 2)),
        rows.load(y, WIDTH * at(corners, place + 3)),
    )


@lane_function
def edge_columns(start, end):
    """x, y and z of four edges, from the rows ``start`` of their first vertices to ``end``."""
    return transposed(
        subtract(end[0], start[0]),
        subtract(end[1], start[1]),
        subtract(end[2], start[2]),
        subtract(end[3], start[3]),
    )


@lane_function
def gather_edges(y, corners, block, edges, work):
    """Write the ``edges`` from corner 0 in ``y``, of a ``block`` of ``corners``, to ``work``."""
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
    """Copy S q, ``d`` (m count, 3), from ``start`` on to ``work[first:]``; the last is repeated."""
    last = d.shape[0] // count - 1
    for lane in range(LANES):
        base = count * min(start + lane, last)
        for i in range(count):
            save(work, first + 3 * i, lane, (d[base + i, 0], d[base + i, 1], d[base + i, 2]))


@lane_function
def add_to(rhs, corners, place, forces):
    """Add ``forces`` to ``rhs`` at ``corners[place:place + 4]``, in turn: two may be the same."""
    for lane in range(WIDTH):
        v = WIDTH * at(corners, place + lane)
        rows.store(rhs, v, add(rows.load(rhs, v), forces[lane]))


@lane_function
def take_from(rhs, corners, place, forces):
    """Opposite of `add_to`: take ``forces`` from ``rhs`` at ``corners`` from ``place`` on."""
    for lane in range(WIDTH):
        v = WIDTH * at(corners, place + lane)
        rows.store(rhs, v, subtract(rows.load(rhs, v), forces[lane]))


@lane_function
def scatter(work, corners, block, edges, rhs):
    """Add the forces of a block in ``work`` to ``rhs``, rows of four, flat.

    Forces on the corners 1, ..., ``edges`` are given; corner 0 gets what makes their sum zero.
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
def store_projections(work, count, start, p):
    """Copy the projections in ``work`` to those of the elements ``start``, ``start + 1``, ...

    p : flat, three numbers a row, ``count`` rows an element
    """
    for lane in range(min(LANES, len(p) // (3 * count) - start)):
        for i in range(count):
            at_p = 3 * (count * (start + lane) + i)
            p[at_p], p[at_p + 1], p[at_p + 2] = load(work, P + 3 * i, lane)


# The order of the mesh is kept if its blocks have at most so many times the vertices that others
# would have. Grids keep theirs.
KEPT = 1.5


def visiting_order(stencil: np.ndarray, vertices: int) -> np.ndarray | None:
    """Elements (e,) in the order to visit them; None for the order that they have.

    They are sorted by their vertices, numbered by the reverse Cuthill-McKee algorithm (Cuthill and
    McKee 1969), which gives neighbours numbers close to each other.

    Parameters
    ----------
    stencil : (e, m) vertices of each element
    vertices : number of all vertices
    """
    if len(stencil) == 0:
        return None
    e, m = stencil.shape
    places = (np.repeat(np.arange(e), m), stencil.ravel())
    incidence = sparse.csr_array((np.ones(e * m), places), shape=(e, vertices))
    neighbours = sparse.csr_array(incidence.T @ incidence)  # with an element in common
    rank = np.empty(vertices, dtype=np.int64)
    rank[csgraph.reverse_cuthill_mckee(neighbours, True)] = np.arange(vertices)
    order = np.lexsort(np.sort(rank[stencil], axis=1).T[::-1])
    return order if _corners(stencil) > KEPT * _corners(stencil[order]) else None


def _corners(stencil: np.ndarray) -> int:
    """Number of vertices of the blocks, added up."""
    blocks = np.arange(len(stencil)) // LANES
    pairs = blocks[:, None] * (int(stencil.max()) + 1) + stencil
    return len(np.unique(pairs))
