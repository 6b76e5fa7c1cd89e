"""A reduction of full-order projections, such as DEIM of joint rows, in a position subspace.

Its modes and its samples stay as they are; what has the length of the mesh is multiplied out, as
for every interpolation in a subspace.
"""

import numpy as np

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.reduction.sampling.reduction import Reduction
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.interpolation import Interpolation, element_rows, reduced_strain


def interpolation_of(
    group: ConstraintGroup, columns: Columns, reduction: Reduction
) -> Interpolation:
    """Interpolation in ``columns`` of a group's projections by a reduction without limits.

    Limits are those of the coefficients.
    Coefficients of blocks that serve one axis each stand below each other.
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
