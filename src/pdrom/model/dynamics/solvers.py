"""Factorisations of the global system: factor once, solve often.

Panels (supernodes) are consecutive columns of a factor that substitution ("sweep") treats together.
Of the rows below its columns, a panel stores those in which at least one column has an entry, with
zeros for its other columns. With wider panels, substitution reads the right-hand side less often
and waits less often for a preceding column, but more zeros are stored. Dynamic programming finds
the partition of the columns with the fewest estimated processor cycles.
"""

from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from pdrom.core.errors import SolverError
from pdrom.model.compiled import rows
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.dynamics.sweeps import SWEEP, WIDTHS, load, sweep

# Estimated processor cycles of the substitution for each panel (mispredicted branch, waiting for
# columns), each row below it and each entry of this row; fitted to 400 to 10,000 vertices.
PANEL, ROW, ENTRY = 20.0, 1.0, 0.5


def panels(lower: sparse.csc_array, diagonal: np.ndarray) -> tuple[Any, ...]:
    """Store L D L^T = A by panels, from L = ``lower`` (n, n) and D = ``diagonal`` (n,).

    L is unit lower triangular with ascending row indices.

    Returns
    -------
    The first argument of `pdrom.model.dynamics.sweeps.sweep`: these arrays for P panels, and the
    address of the compiled code of `sweep`.

    first : (P + 1,) first column of each panel
    row_start, value_start : (P + 1,) first index of each panel in ``rows`` and in ``values``
    rows : indices of the rows below each panel, times `pdrom.model.compiled.rows.WIDTH`
    values : for each panel of w columns with m rows below: 1 / D (w,), the strict lower triangle of
        L in the w rows of the panel, row by row, then the part of L in the m rows below, (m, w)
    """
    n = lower.shape[0]
    below = np.zeros((max(WIDTHS) + 1, n), np.int64)
    _count_rows_below(lower.indptr, lower.indices, np.full(n, -1), below)
    chosen, column, columns = np.zeros(n + 1, np.int64), n, []
    _choose(below, np.array(WIDTHS), np.full(n + 1, np.inf), chosen)
    while column > 0:
        columns.append(column)
        column -= int(chosen[column])
    ends = np.array(columns[::-1], np.int64)
    width = np.diff(ends, prepend=0)
    count = below[width, ends - 1]
    first = np.concatenate([[0], ends]).astype(np.int32)
    row_start = np.concatenate([[0], np.cumsum(count)])
    own = width + width * (width - 1) // 2
    value_start = np.concatenate([[0], np.cumsum(own + count * width)])
    rows, values = np.empty(row_start[-1], np.int32), np.zeros(value_start[-1])
    _fill(
        lower.indptr, lower.indices, lower.data, 1.0 / diagonal, first, row_start, value_start,
        rows, values, np.full(n, -1),
    )  # fmt: skip
    return first, row_start, value_start, rows, values, SWEEP.address


@compiled
def _count_rows_below(indptr, indices, seen, below):
    """Write to below[w, j] how many rows below row j have an entry in columns j - w + 1 to j.

    ``seen`` (n,) is working memory, filled with -1. Python allocates all arrays, because an
    allocation in compiled code takes 0.1 s to compile.
    """
    for j in range(len(seen)):
        count = 0
        for width in range(1, min(len(below) - 1, j + 1) + 1):
            column = j - width + 1
            for k in range(indptr[column], indptr[column + 1]):
                row = indices[k]
                if row > j and seen[row] != j:
                    seen[row] = j
                    count += 1
            below[width, j] = count


@compiled
def _choose(below, widths, cost, chosen):
    """Write to chosen[k] the last panel's width in the cheapest division of the first k columns.

    ``below``: see `_count_rows_below`. ``cost`` (n + 1,) is working memory, filled with inf.
    """
    cost[0] = 0.0
    for end in range(1, len(cost)):
        for width in widths:
            if width <= end:
                rows = below[width, end - 1]
                own = cost[end - width] + PANEL + rows * (ROW + ENTRY * width)
                if own < cost[end]:
                    cost[end], chosen[end] = own, width


@compiled
def _fill(indptr, indices, data, inverse, first, row_start, value_start, rows, values, place):
    """Fill ``rows`` and ``values``, which `panels` returns; ``place`` (n,): work memory, all -1."""
    for panel in range(len(first) - 1):
        a, b = first[panel], first[panel + 1]
        width, start = b - a, row_start[panel]
        count = 0
        for k in range(indptr[a], indptr[b]):
            row = indices[k]
            if row >= b and place[row] < 0:
                place[row] = 0
                # insertion sort: indices are nearly sorted; NumPy's sort takes a second to compile
                new = start + count
                while new > start and rows[new - 1] > row:
                    rows[new] = rows[new - 1]
                    new -= 1
                rows[new] = row
                count += 1
        for k in range(count):
            place[rows[start + k]] = k
        triangle = value_start[panel] + width
        rest = triangle + width * (width - 1) // 2
        for j in range(a, b):
            values[value_start[panel] + j - a] = inverse[j]
            for k in range(indptr[j], indptr[j + 1]):
                row = indices[k]
                if row >= b:
                    values[rest + place[row] * width + j - a] = data[k]
                elif row > j:
                    values[triangle + (row - a) * (row - a - 1) // 2 + j - a] = data[k]
        for k in range(count):
            place[rows[start + k]] = -1
            rows[start + k] *= WIDTH


# A factor is a tuple of the first four arguments of `sweeps.sweep`: panels, vertices, loads, x.
Factor = tuple[tuple[Any, ...], np.ndarray, np.ndarray, np.ndarray]
NOTHING_FREE: Factor = (
    (np.zeros(1, np.int32), *(np.zeros(1, np.int64),) * 2, np.zeros(0, np.int32), np.zeros(0), 0),
    np.zeros(0, np.int32),
    np.zeros(0),
    np.zeros(0),
)
# Empty coupling, as `sweeps.load` reads it: no unknown is coupled to a held (prescribed) vertex.
NO_COUPLING = (np.zeros(0, np.int64), np.zeros(1, np.int32), np.zeros(0, np.int32), np.zeros(0))


class SuperLUSolver:
    """A symmetric positive definite matrix, factored and solved by SuperLU of SciPy.

    matrix : (n, n)
    vertices : (n,) vertex index of each unknown: its row in arrays (N, 3)
    coupling : (n, m) matrix entries between the unknowns and m held vertices; None if m = 0
    """

    factor: Factor | None = None
    """First arguments of `sweeps.sweep` in compiled loops; None if the solver is not compiled."""
    coupling = NO_COUPLING
    """Matrix entries between unknowns and held vertices, in the form of `sweeps.load`."""

    def __init__(
        self,
        matrix: sparse.csr_array,
        vertices: np.ndarray,
        coupling: sparse.csr_array | None = None,
    ) -> None:
        self._vertices, self._held = vertices, coupling
        self._load = np.zeros((len(vertices), 3))
        self._take(factored(matrix))

    def _take(self, factor: SuperLU) -> None:
        """Store the ``factor`` in the form that `solve` needs."""
        self._factor = factor

    def set_targets(self, targets: np.ndarray) -> None:
        """Set the positions ``targets`` (m, 3) m of the held vertices for all following solves."""
        if self._held is not None:
            self._load = self._held @ targets

    def solve(self, rhs: np.ndarray, y: np.ndarray) -> None:
        """Overwrite the rows ``vertices`` of ``y`` (N, 3) by the solution for ``rhs`` (N, 3)."""
        y[self._vertices] = self._factor.solve(rhs[self._vertices] - self._load)


class SupernodalSolver(SuperLUSolver):
    """SuperLU's factor stored by panels, with compiled substitution of x, y and z in one pass.

    factor : first arguments of `pdrom.model.dynamics.sweeps.sweep`
    """

    factor: Factor

    def _take(self, factor: SuperLU) -> None:
        lower = sparse.csc_array(factor.L)
        lower.sort_indices()
        unknowns = np.argsort(factor.perm_c)
        order = self._vertices[unknowns].astype(np.int32)
        loads, work = rows.zeros(rows.WIDTH * len(order)), rows.empty(rows.WIDTH * len(order))
        self.factor = panels(lower, factor.U.diagonal()), order, loads, work
        if self._held is not None:
            own = sparse.csr_array(self._held[unknowns])
            # rows of the few unknowns that are coupled to held vertices
            beside = np.flatnonzero(np.diff(own.indptr))
            index = (each.astype(np.int32) for each in (own.indptr, own.indices))  # one type
            self.coupling = beside, *index, own.data

    def set_targets(self, targets: np.ndarray) -> None:
        if len(self.coupling[0]):
            load(*self.coupling, np.ascontiguousarray(targets), self.factor[2])

    def solve(self, rhs: np.ndarray, y: np.ndarray) -> None:
        right, solution = rows.flat(rhs), rows.flat(y)
        sweep(*self.factor, right, solution)
        if not rows.shares(y, solution):
            y[...] = rows.unflat(solution)


SOLVERS = {"supernodal": SupernodalSolver, "splu": SuperLUSolver}


def factored(matrix: sparse.csr_array) -> SuperLU:
    """Factor ``matrix`` (n, n) by SuperLU without pivoting.

    Raises SolverError if the matrix is singular or not positive definite.
    """
    size, options = matrix.shape[0], {"SymmetricMode": True}
    try:
        factor = splu(matrix.tocsc(), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError as error:
        raise SolverError(f"global system of size {size}: {error}") from error
    symmetric = np.array_equal(factor.perm_r, factor.perm_c)
    if not (symmetric and (factor.U.diagonal() > 0.0).all()):
        raise SolverError(f"global system of size {size}: not positive definite")
    return factor
