"""Local steps in the coordinates of a position subspace, by sampling or by interpolation.

Interpolation evaluates a few elements, computes coefficients c from their projections, and from c
the right-hand side B^T S^T W (mean + V c); the system matrix is the same as with all projections.
"""

from dataclasses import dataclass

import numpy as np

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.reduction.sampling.reduction import Reduction, element_rows
from pdrom.reduction.subspace.columns import Columns


@dataclass(frozen=True)
class Interpolation:
    """Arrays that one group needs during a run, in a subspace of K coordinates.

    operator : (r, n), maps sampled values to coefficients; n = m p if it is applied to each axis
        (coefficients (r, 3)), n = 3 m p if the axes share the coefficients (r, 1)
    """

    elements: np.ndarray  # (m,) sampled, of p rows, ascending; none if projections are constant
    operator: np.ndarray
    modes: np.ndarray  # B^T S^T W V, (K, r) for coefficients of each axis, (3 K, r) for shared ones
    offset: np.ndarray  # (K, 3) constant part of the right-hand side
    stiffness: np.ndarray  # (K, K) B^T S^T W S B of all elements
    gain: float  # DEIM constant || operator ||_2, by which errors of samples can grow


class InterpolatedLocalStep:
    """Local step of a group whose projections are interpolated from those of a few elements."""

    def __init__(
        self, group: ConstraintGroup, columns: Columns, interpolation: Interpolation
    ) -> None:
        self.name, self.matrix = group.name, interpolation.stiffness
        self._interpolation = interpolation
        self._elements = np.arange(len(interpolation.elements))
        if len(self._elements) == 0:
            return
        self.group, vertices = group.restricted(
            interpolation.elements, np.ones(len(self._elements))
        )
        self._sampler = self.group.sampler(self._elements)
        self._rows = np.ascontiguousarray(columns.B[vertices])

    def begin_frame(self, q: np.ndarray) -> None:
        """Compute, for sampled elements at q (K, 3), data that stay fixed during the frame."""
        if len(self._elements):
            self.group.begin_frame(self._rows @ q)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add B^T S^T W p at ``y`` (K, 3) to ``rhs`` (K, 3); return nan for the unknown energy."""
        i = self._interpolation
        rhs += i.offset
        if len(self._elements) == 0:
            return float("nan")
        count = self.group.rows_per_element * len(self._elements)
        values = self._sampler.projections(self._rows @ y, count)
        coefficients = i.operator @ values.reshape(i.operator.shape[1], -1)
        rhs += (i.modes @ coefficients).reshape(rhs.shape)
        return float("nan")


def reduced_strain(group: ConstraintGroup, columns: Columns) -> tuple[np.ndarray, np.ndarray]:
    """Compute S B (e p, K) and B^T S^T W S B (K, K) of ``group``; B is that of ``columns``."""
    strain = group.S @ columns.B
    return strain, strain.T @ (group.row_weights[:, None] * strain)


def interpolation_of(
    group: ConstraintGroup, columns: Columns, reduction: Reduction
) -> Interpolation:
    """Convert a ``reduction`` of full-order projections to the subspace with the given ``columns``.

    If the axes have separate coefficients, these are stacked.
    """
    strain, stiffness = reduced_strain(group, columns)
    weighted = group.row_weights[:, None] * strain
    elements = np.sort(reduction.elements)
    entries = element_rows(elements, 3 * group.rows_per_element)
    count, mean = sum(len(block.operator) for block in reduction.blocks), reduction.basis.mean
    operator, modes = np.zeros((count, len(entries))), np.zeros((strain.shape[1], 3, count))
    last = 0
    for block in reduction.blocks:
        own = slice(last, last := last + len(block.operator))
        operator[own, np.searchsorted(entries, block.entries)] = block.operator
        for axis in range(3) if block.axis is None else (block.axis,):
            modes[:, axis, own] = weighted.T @ reduction.v[axis::3]
    lifted = modes.reshape(-1, count)
    offset = weighted.T @ mean.reshape(-1, 3)
    offset -= (lifted @ (operator @ mean[entries])).reshape(-1, 3)
    return Interpolation(elements, operator, lifted, offset, stiffness, reduction.gain)


class SubspaceLocalStep:
    """Local step in subspace coordinates z: B^T S^T W p(S B z), summed over some or all elements.

    ``factors`` multiply weights of ``elements``; all elements with factors 1 are exact.
    """

    def __init__(
        self,
        group: ConstraintGroup,
        columns: Columns,
        elements: np.ndarray | None = None,
        factors: np.ndarray | None = None,
    ) -> None:
        self.name = group.name
        elements = np.arange(group.elements) if elements is None else elements
        factors = np.ones(len(elements)) if factors is None else factors
        self.group, vertices = group.restricted(elements, factors)
        self._rows = np.ascontiguousarray(columns.B[vertices])
        self._transposed = np.ascontiguousarray(self._rows.T)
        self._rhs = np.empty((len(vertices), 3))

    @property
    def strain(self) -> np.ndarray:
        """Matrix S B (m p, K): p rows of S for each of m sampled elements times the K columns B."""
        return self.group.S @ self._rows

    @property
    def matrix(self) -> np.ndarray:
        """Stiffness B^T S^T W S B of the sampled elements, (K, K)."""
        strain = self.strain
        return strain.T @ (self.group.row_weights[:, None] * strain)

    def begin_frame(self, q: np.ndarray) -> None:
        """Compute, at the coordinates q (K, 3), data of the group that stay fixed in the frame."""
        self.group.begin_frame(self._rows @ q)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add B^T S^T W p at ``y`` (K, 3) to ``rhs`` (K, 3); return the energy of `group`, J."""
        self._rhs[...] = 0.0
        energy = self.group.accumulate(self._rows @ y, self._rhs)
        rhs += self._transposed @ self._rhs
        return energy
