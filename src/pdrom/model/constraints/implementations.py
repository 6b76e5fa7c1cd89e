"""Slower implementations of the local step, to measure what claim C1 depends on.

Each does what the compiled kernels of a group do, in another way; results agree to round-off.
"""

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
from scipy import sparse

from pdrom.model.constraints.base import ConstraintGroup


class _Slower:
    """Base of the implementations; the time of their products with S^T is counted separately."""

    implementation: str

    def __init__(self, group: ConstraintGroup) -> None:
        self.name = group.name
        self.group = group
        self.assembly_seconds = 0.0

    def begin_frame(self, q: np.ndarray) -> None:
        self.group.begin_frame(q)


class NumpyLocalStep(_Slower):
    """Vectorised NumPy projections of all elements, SciPy sparse products around them."""

    implementation = "numpy"

    def __init__(self, group: ConstraintGroup) -> None:
        super().__init__(group)
        self._shape = (group.elements, group.rows_per_element, 3)
        self._all = np.arange(group.elements)
        self._weights = group.row_weights[:, None]
        self._lift = sparse.csr_array(group.S.T.multiply(group.row_weights[None, :]))

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) of ``y`` (N, 3) m to ``rhs`` (N, 3) and return the energy, J."""
        d = self.group.S @ y
        p = self.group.reference_project(d.reshape(self._shape), self._all).reshape(d.shape)
        energy = 0.5 * float(np.sum(self._weights * (d - p) ** 2))
        before = perf_counter()
        rhs += self._lift @ p
        self.assembly_seconds += perf_counter() - before
        return energy


class InterpretedLocalStep(_Slower):
    """One element after the other in interpreted Python, as straightforward codes do it."""

    implementation = "interpreted"

    def __init__(self, group: ConstraintGroup) -> None:
        super().__init__(group)
        rows = group.rows_per_element
        self._blocks = []
        for e in range(group.elements):
            block = group.S[rows * e : rows * (e + 1)]
            columns = np.unique(block.indices)
            self._blocks.append((columns, block.toarray()[:, columns], group.weights[e]))

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) of ``y`` (N, 3) m to ``rhs`` (N, 3) and return the energy, J."""
        energy = 0.0
        for e, (columns, block, weight) in enumerate(self._blocks):
            d = block @ y[columns]
            p = self.group.reference_project(d[None], np.array([e]))[0]
            energy += 0.5 * weight * float(np.sum((d - p) ** 2))
            before = perf_counter()
            rhs[columns] += weight * (block.T @ p)
            self.assembly_seconds += perf_counter() - before
        return energy


# Makers of a local step of the step loop, by name.
IMPLEMENTATIONS: dict[str, Callable[[ConstraintGroup], Any]] = {
    "numpy": NumpyLocalStep,
    "interpreted": InterpretedLocalStep,
}
