"""Panels of a sparse factor: consecutive columns that are swept together.

The rows below the columns of a panel are the union of those of its columns; a column has zeros
where it had none. The wider a panel, the fewer numbers are read twice and the fewer times the sweep
waits for the column before; the more zeros it stores. Which columns go together is decided by
dynamic programming over a cost in processor cycles.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.dynamics.sweeps import SWEEP

WIDTHS = np.array([1, 2, 3, 4, 6, 8])
# Cycles of a panel (a branch that is guessed wrong, the chain of its own columns) and of each row
# below, for each column and for the row itself; fitted to sheets and bars of 400 to 10,000
# vertices.
PANEL, ROW, ENTRY = 20.0, 1.0, 0.5


@dataclass(frozen=True)
class Panels:
    """L D L^T = A with a unit lower triangular L (n, n), by panels.

    first : (P + 1,) first column of each panel
    row_start, value_start : (P + 1,) where its rows and numbers begin
    rows : rows below each panel, times `pdrom.model.compiled.rows.WIDTH`
    values : of each panel with w columns 1 / D (w), the triangle of L row by row without its
        diagonal, then the rows below (m, w)
    """

    first: np.ndarray
    row_start: np.ndarray
    value_start: np.ndarray
    rows: np.ndarray
    values: np.ndarray

    @classmethod
    def of(cls, lower: sparse.csc_array, diagonal: np.ndarray) -> "Panels":
        """Panels of L = ``lower`` (n, n) with ascending row indices and D = ``diagonal`` (n,)."""
        n = lower.shape[0]
        below = np.zeros((int(WIDTHS.max()) + 1, n), np.int64)
        _count_rows_below(lower.indptr, lower.indices, np.full(n, -1), below)
        ends = _partition(below)
        width = np.diff(ends, prepend=0)
        rows = below[width, ends - 1]
        first = np.concatenate([[0], ends]).astype(np.int32)
        row_start = np.concatenate([[0], np.cumsum(rows)])
        own = width + width * (width - 1) // 2
        value_start = np.concatenate([[0], np.cumsum(own + rows * width)])
        panels = cls(
            first, row_start, value_start, np.empty(row_start[-1], np.int32),
            np.zeros(value_start[-1]),
        )  # fmt: skip
        _fill(
            lower.indptr, lower.indices, lower.data, 1.0 / diagonal, first, row_start, value_start,
            panels.rows, panels.values, np.full(n, -1),
        )  # fmt: skip
        return panels

    @property
    def bytes(self) -> int:
        """Bytes that one sweep reads."""
        return sum(array.nbytes for array in self.arrays)

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """Arrays in the order in which `pdrom.model.dynamics.sweeps.sweep` takes them."""
        return self.first, self.row_start, self.value_start, self.rows, self.values

    @property
    def factor(self) -> tuple[Any, ...]:
        """First argument of `pdrom.model.dynamics.sweeps.sweep`."""
        return *self.arrays, SWEEP.address


@compiled
def _count_rows_below(indptr, indices, seen, below):
    """below[w, j]: rows below the panel of the w columns that end with column j.

    ``seen`` (n,) is working memory of -1. Arrays are made by Python here: each kind of allocation
    takes a tenth of a second to compile.
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


def _partition(below: np.ndarray) -> np.ndarray:
    """End column (exclusive) of each panel in the cheapest partition, ascending."""
    n = below.shape[1]
    chosen = np.zeros(n + 1, np.int64)
    _choose(below, WIDTHS, np.full(n + 1, np.inf), chosen)
    ends = []
    end = n
    while end > 0:
        ends.append(end)
        end -= int(chosen[end])
    return np.array(ends[::-1], np.int64)


@compiled
def _choose(below, widths, cost, chosen):
    """Write the width of the last panel of the cheapest partition of the columns before each one.

    ``cost`` (n + 1,) is working memory of inf.
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
    """Write the rows and numbers of all panels; ``place`` (n,) is working memory of -1."""
    for panel in range(len(first) - 1):
        a, b = first[panel], first[panel + 1]
        width, start = b - a, row_start[panel]
        count = 0
        for k in range(indptr[a], indptr[b]):
            row = indices[k]
            if row >= b and place[row] < 0:
                place[row] = 0
                # columns are sorted: few rows are not at the end (a compiled sort takes a second)
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
