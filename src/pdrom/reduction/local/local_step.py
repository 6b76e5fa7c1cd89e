"""The reduced local step: S^T W p(y) is replaced by S^T W (mean + V c(y))."""

from collections.abc import Callable

import numpy as np

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.constraints.second_thread import both
from pdrom.reduction.sampling.reduction import Reduction

SPLIT_FROM = 1 << 17  # entries of a lift (N, r) from which its rows are in two parts


class ReducedLocalStep:
    """Evaluates sampled elements of a group and lifts their coefficients to the right-hand side.

    Precomputed: the offset S^T W mean (N, 3), the lift S^T W V for each coefficient block, and the
    solution operators. Online: the projections of the sampled elements, a small dense product for
    c, and the dense lift, shared by the group's threads.
    """

    def __init__(self, group: ConstraintGroup, reduction: Reduction) -> None:
        self.name = group.name
        self._group = group
        self._elements = np.ascontiguousarray(reduction.elements)
        self._everything = len(self._elements) == group.elements
        mean = reduction.basis.mean.reshape(-1, 3)
        lift = group.S.T.multiply(group.row_weights[None, :]).tocsr()
        self._offset = lift @ mean
        self._limited = reduction.limited
        self._parts = _parts(len(self._offset), reduction.r)
        place = _local_positions(reduction)
        self._blocks = []
        for block in reduction.blocks:
            modes = reduction.v[block.output]
            columns = modes.reshape(len(mean), -1)
            lifted = np.ascontiguousarray((lift @ columns).reshape(-1, reduction.r))
            shift = block.operator @ reduction.basis.mean[block.entries]
            self._blocks.append((block.axis, place(block.entries), block.operator, shift, lifted))

    def begin_frame(self, q: np.ndarray) -> None:
        """Freeze frame-lagged data of the sampled elements only."""
        self._group.begin_frame(q, None if self._everything else self._elements)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add the reduced S^T W p(y) to ``rhs`` (N, 3); the energy is unknown: nan."""
        coefficients = self.coefficients(y)
        for block, values in enumerate(coefficients):
            self._observe(block, values)
        self.lift(coefficients, rhs)
        return float("nan")

    def _observe(self, block: int, coefficients: np.ndarray) -> None:
        """Called with the coefficients of every block; a watched step looks at them."""

    def coefficients(self, y: np.ndarray) -> list[np.ndarray]:
        """Coefficients (r,) of each block, from the projections of the sampled elements."""
        return self.solve(self.sample(y))

    def sample(self, y: np.ndarray) -> np.ndarray:
        """Projections of the sampled elements, as one vector."""
        return self._group.project_elements(y, self._elements).ravel()

    def solve(self, sampled: np.ndarray) -> list[np.ndarray]:
        """Coefficients (r,) of each block, from what `sample` gives; the systems are inverted."""
        return [
            self._limited(operator @ sampled[positions] - shift)
            for _, positions, operator, shift, _ in self._blocks
        ]

    def lift(self, coefficients: list[np.ndarray], rhs: np.ndarray) -> None:
        """Add S^T W (mean + V c) to ``rhs`` (N, 3)."""

        def add(rows: slice) -> float:
            own = rhs[rows]
            own += self._offset[rows]
            for (axis, *_, lifted), c in zip(self._blocks, coefficients, strict=True):
                if axis is None:
                    own += (lifted[3 * rows.start : 3 * rows.stop] @ c).reshape(own.shape)
                else:
                    own[:, axis] += lifted[rows] @ c
            return 0.0

        first, *others = self._parts
        if others:
            both(lambda: add(first), lambda: add(others[0]), self._group.threads)
        else:
            add(first)


def _parts(vertices: int, r: int) -> list[slice]:
    """One or two ranges of vertices, whatever the number of threads, which thus changes no bits."""
    middle = vertices // 2 if vertices * r >= SPLIT_FROM else vertices
    return [slice(0, middle), slice(middle, vertices)][: 1 + (middle < vertices)]


def _local_positions(reduction: Reduction) -> Callable[[np.ndarray], np.ndarray]:
    """Map from entries of the full vector to entries of the sampled elements' vector."""
    size = 3 * reduction.basis.rows_per_element
    order = np.argsort(reduction.elements, kind="stable")
    ordered = reduction.elements[order]

    def place(entries: np.ndarray) -> np.ndarray:
        element, inside = np.divmod(entries, size)
        return size * order[np.searchsorted(ordered, element)] + inside

    return place
