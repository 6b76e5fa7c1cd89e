"""Q-DEIM: blocks of rows selected by a pivoted QR factorisation (Drmac and Gugercin 2016)."""

from collections.abc import Sequence

import numpy as np

from pdrom.reduction.sampling.deim import Selection, tie_weights

EPS = np.finfo(float).eps
# Pivots are searched among ROWS_A_MODE rows per mode. After a search that finds fewer than FEW
# pivots, the next is among twice as many rows.
ROWS_A_MODE, FEW = 2, 8


def qdeim_elements(v: np.ndarray, size: int) -> np.ndarray:
    """Select min(e, r) elements of the basis ``v`` (size e, r) by Q-DEIM.

    Pivots are chosen among the columns of V^T, in groups of the ``size`` columns of an element.
    The group with the largest Frobenius norm (times `tie_weights`) is selected, and the direction
    in R^r that dominates it is projected out of all groups. For ``size`` 1 this is the published
    method. For larger sizes, one direction per element (the whole group would exhaust R^r) gives as
    many elements as modes. The removed directions are orthonormal and lie in the span of the
    selected groups, so that the sampled rows of V have full column rank. Cost O(size e r^2).
    """
    left = _Left(v, size)
    candidates = min(left.total, ROWS_A_MODE * v.shape[1] // size + 1)
    count = min(v.shape[1], left.total)
    while len(left.picked) < count:
        if left.pick_among(candidates, count) < FEW:
            candidates = min(left.total, 2 * candidates)
    return np.array(left.picked, dtype=np.int64)


class _Left:
    """Groups of columns of V^T, one per element; directions of earlier pivots are projected out.

    Their norms only decrease, so that old norms are upper bounds. Of the groups with the largest
    bounds, the one with the largest norm is the next pivot if it exceeds the bounds of all others;
    otherwise all bounds are updated. V is thus read a few times, not once per pivot.
    """

    def __init__(self, v: np.ndarray, size: int) -> None:
        self._rows, self._size = np.ascontiguousarray(v), size
        self.total = len(v) // size
        self.picked: list[int] = []
        self._weights = tie_weights(self.total) ** 2
        self._directions = np.empty((0, v.shape[1]))
        self._squares = self._norms(self._rows)
        self._error = self._rounding(self._squares)

    def pick_among(self, count: int, most: int) -> int:
        """Add pivots among ``count`` elements whose norms have the largest bounds; return how many.

        At most ``most`` elements are selected in total, those of earlier calls included.
        """
        candidates, rest = self._highest(count)
        left = self._rows.reshape(self.total, self._size, -1)[candidates]
        left = left.reshape(len(candidates) * self._size, -1)
        left = left - (left @ self._directions.T) @ self._directions
        weights, before = self._weights[candidates], len(self.picked)
        weights[np.isin(candidates, self.picked)] = -1.0
        while True:
            squares = self._norms(left)
            best = int(np.argmax(weights * squares - (weights < 0.0)))
            if len(self.picked) == most or weights[best] * squares[best] <= rest:
                break
            weights[best] = -1.0
            self.picked.append(int(candidates[best]))
            # leading right singular vector of the element's projected rows; zero if these are zero
            group = left[self._size * best : self._size * (best + 1)]
            direction = np.linalg.svd(group, full_matrices=False)[2][0] if group.any() else group[0]
            direction = direction - self._directions.T @ (self._directions @ direction)
            direction /= np.linalg.norm(direction) or 1.0
            self._directions = np.vstack([self._directions, direction])
            left -= np.outer(left @ direction, direction)
        new = self._directions[before:]
        self._squares -= self._norms(self._rows @ new.T)
        self._squares[candidates] = squares
        self._error[candidates] = self._rounding(squares)
        return len(new)

    def _highest(self, count: int) -> tuple[np.ndarray, float]:
        """``count`` elements with the largest bounds of weighted norms; others' largest, or -1."""
        bounds = self._weights * (self._squares + self._error)
        bounds[self.picked] = -1.0
        if count == self.total:
            return np.arange(self.total), -1.0
        split = np.argpartition(bounds, self.total - count)
        rest = bounds[split[: self.total - count]].max()
        return np.sort(split[self.total - count :]), float(rest)

    def _norms(self, rows: np.ndarray) -> np.ndarray:
        """Squared Frobenius norm of the rows of each element, which are consecutive in ``rows``."""
        return np.einsum("nk,nk->n", rows, rows).reshape(-1, self._size).sum(axis=1)

    def _rounding(self, squares: np.ndarray) -> np.ndarray:
        """Bound on the rounding errors of squared norms that are updated by subtraction."""
        return 4.0 * self._rows.shape[1] * EPS * squares


class PivotedQR(Selection):
    """Q-DEIM; the samples for fewer modes need not be among those for more modes."""

    def one_a_mode(self, v: np.ndarray, size: int, ranks: Sequence[int]) -> dict[int, np.ndarray]:
        return {r: qdeim_elements(v[:, :r], size) for r in ranks}
