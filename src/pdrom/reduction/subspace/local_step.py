"""Local steps in the coordinates of a position subspace."""

import numpy as np

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.reduction.subspace.columns import Columns


class SubspaceLocalStep:
    """Weighted projections of some (or all) elements, B^T S^T W p(S B z).

    With all elements and unit factors these are the full projections in the subspace; with few
    elements and the factors of energy-conserving sampling the cost does not depend on the mesh.
    """

    def __init__(
        self,
        group: ConstraintGroup,
        columns: Columns,
        elements: np.ndarray | None = None,
        factors: np.ndarray | None = None,
    ) -> None:
        self.name = group.name
        if elements is None:
            elements = np.arange(group.elements)
        if factors is None:
            factors = np.ones(len(elements))
        self.group, vertices = group.restricted(elements, factors)
        self._rows = np.ascontiguousarray(columns.B[vertices])
        self._transposed = np.ascontiguousarray(self._rows.T)
        self._rhs = np.empty((len(vertices), 3))

    @property
    def strain(self) -> np.ndarray:
        """S B of the sampled elements, (m p, K): all that an iteration needs of the mesh."""
        return self.group.S @ self._rows

    @property
    def matrix(self) -> np.ndarray:
        """B^T S^T W S B of the sampled elements, (K, K)."""
        strain = self.strain
        return strain.T @ (self.group.row_weights[:, None] * strain)

    def begin_frame(self, q: np.ndarray) -> None:
        """Freeze frame-lagged data at the coordinates q (K, 3)."""
        self.group.begin_frame(self._rows @ q)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add B^T S^T W p at ``y`` (K, 3) to ``rhs`` (K, 3); return the sampled energy."""
        self._rhs[...] = 0.0
        energy = self.group.accumulate(self._rows @ y, self._rhs)
        rhs += self._transposed @ self._rhs
        return energy
