"""Hyper-reduced projective dynamics: sampled constraints with interpolation.

Brandt, Eisemann and Hildebrandt (2018, sect. 5) represent the projections of a group in a smooth,
low-dimensional space, fitted to the projections of sampled constraints by weighted least squares.
The space needs no training: its functions are skinning weights on the elements times the rest
vectors S q_rest, so that it contains all linear maps of the rest shape that vary slowly over the
mesh. The weights themselves, which the source adds as columns for translations, are left out, since
S annihilates translations.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy import linalg

from pdrom.core.errors import SamplingError
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.mesh.selection import farthest_points
from pdrom.reduction.basis import pod
from pdrom.reduction.sampling.reduction import element_rows, norm_and_condition, solution_operator
from pdrom.reduction.snapshots import touched_vertices
from pdrom.reduction.subspace.columns import DEPENDENT, Columns, orthonormal, skinning_weights
from pdrom.reduction.subspace.interpolation import Interpolation, reduced_strain

# Largest allowed condition number of a basis at its sampled rows; a larger one is an error.
SINGULAR = 1e8


class HrpdSpec(ConfigModel):
    """Sampled constraints with interpolation (Brandt et al. 2018).

    dimension : largest dimension of the space of projections
    samples : largest number of sampled elements
    """

    dimension: Annotated[int, Field(ge=1, le=10_000)] = 60
    samples: Annotated[int, Field(ge=1, le=1_000_000)] = 250


def hrpd(group: ConstraintGroup, columns: Columns, sampled: "SampledSpace | None") -> Interpolation:
    """Interpolate projections of ``group`` in the space ``sampled``; if this is None, all are 0."""
    strain, stiffness = reduced_strain(group, columns)
    offset = np.zeros((len(stiffness), 3))
    if sampled is None:
        none, empty = np.empty(0, dtype=np.int64), np.empty((len(stiffness), 0))
        return Interpolation(none, np.empty((0, 0)), empty, offset, stiffness, gain=1.0)
    modes = strain.T @ (group.row_weights[:, None] * sampled.V)
    return Interpolation(sampled.elements, sampled.operator, modes, offset, stiffness, sampled.gain)


@dataclass(frozen=True)
class SampledSpace:
    """A space of projections, and the operator that fits its coefficients to sampled elements."""

    V: np.ndarray  # (e p, d) basis, orthonormal in the inner product of the weights W; for x, y, z
    elements: np.ndarray  # (m,) sampled elements, ascending
    operator: np.ndarray  # (d, m p) maps sampled projections to coefficients, by least squares in W
    gain: float  # DEIM constant || (P^T W^(1/2) V)^+ ||_2; P^T selects the sampled rows


def sampled_space(
    group: ConstraintGroup, points: np.ndarray, spec: HrpdSpec
) -> SampledSpace | None:
    """Return the space of projections of ``group``; None if S ``points`` are rounding errors.

    ``points`` (N, 3) m is the rest shape. SamplingError if the samples do not determine the space.
    """
    rest = group.S @ points
    if np.linalg.norm(rest) <= group.roundoff(points):
        return None
    centres, count = element_centres(group, points), min(spec.samples, group.elements)
    elements = np.sort(farthest_points(centres, np.arange(group.elements), count))
    V = projection_space(rest, centres, group.row_weights, spec.dimension)
    rows = element_rows(elements, group.rows_per_element)
    root = np.sqrt(group.row_weights[rows])
    weighted = root[:, None] * V[rows]
    operator = solution_operator(weighted, "qr", 0.0)
    gain, condition = norm_and_condition(weighted, operator)
    if condition > SINGULAR:
        raise SamplingError(
            f"hrpd: group '{group.name}': {len(elements)} samples do not determine a space of "
            f"dimension {V.shape[1]}; allowed are more samples or a smaller dimension"
        )
    return SampledSpace(V, elements, operator * root, gain)


def projection_space(
    rest: np.ndarray, centres: np.ndarray, weights: np.ndarray, dimension: int
) -> np.ndarray:
    """Build W-orthonormal columns (e p, d) of the span of skinning weights times rest vectors.

    The rest vectors come first, so that the rest shape and its rotations are exact. POD modes of
    the products, without their part along the rest vectors, follow.

    ``rest`` (e p, 3) are the rest vectors, ``centres`` (e, 3) m those of the elements, ``weights``
    (e p,) the diagonal of W; ``dimension`` is the largest number d of columns.
    """
    root = np.sqrt(weights)[:, None]
    active = rest[:, np.linalg.norm(rest, axis=0) > DEPENDENT * np.linalg.norm(rest)]
    fixed = orthonormal(root * active)
    wanted = max(dimension - fixed.shape[1], 0)
    handles = max(2, -(-dimension // fixed.shape[1]))
    while True:
        handles = min(handles, len(centres))
        blend = np.repeat(skinning_weights(centres, handles), len(rest) // len(centres), axis=0)
        raw = root * (blend[:, :, None] * active[:, None, :]).reshape(len(rest), -1)
        modes, sigma = pod(raw - fixed @ (fixed.T @ raw))
        useful = int(np.count_nonzero(sigma > DEPENDENT * linalg.norm(raw, 2)))
        if useful >= wanted or handles == len(centres):
            return np.hstack([fixed, modes[:, : min(wanted, useful)]])[:, :dimension] / root
        handles += 1


def element_centres(group: ConstraintGroup, points: np.ndarray) -> np.ndarray:
    """Return centres (e, 3) m of elements: means of the ``points`` (N, 3) m at their vertices."""
    touched = touched_vertices(group)
    return (touched @ points) / np.asarray(touched.sum(axis=1)).reshape(-1, 1)
