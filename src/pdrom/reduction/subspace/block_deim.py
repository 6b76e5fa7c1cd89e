"""Block DEIM (and its oversampled form, gappy POD) in a position subspace.

The projections p ~ mean + V c have a basis V of training snapshots with coefficients shared by the
axes; c is fitted to all entries of sampled elements. Which snapshots train, how many elements are
sampled and what is interpolated decides whether a run stays on its way: see `InterpolationSpec`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdrom.core.errors import SamplingError, SnapshotError
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.reduction.basis.pod import pod
from pdrom.reduction.basis.rank import numerical_rank
from pdrom.reduction.sampling.block import block_elements
from pdrom.reduction.sampling.gappy_pod_e import bound_gain, oversample
from pdrom.reduction.sampling.solve import norm_and_condition, solution_operator
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.interpolation import Interpolation, element_rows, reduced_strain
from pdrom.reduction.subspace.specs import InterpolationSpec

States = Sequence[tuple[np.ndarray, np.ndarray]]
"""Pairs of positions (N, 3): at the beginning of a frame, and where the projections are taken."""


@dataclass(frozen=True)
class TrainedBasis:
    """Snapshots (n, 3 e p) of a group, their mean (zero if not centred), and the modes V.

    V : (3 e p, rank); no column is made of round-off
    """

    snapshots: np.ndarray
    mean: np.ndarray
    V: np.ndarray


def train_basis(group: ConstraintGroup, states: States, spec: InterpolationSpec) -> TrainedBasis:
    """Basis of what ``spec`` interpolates for ``group``, at ``states``; SnapshotError for none."""
    snapshots = training_snapshots(group, states, spec.interpolates == "residual")
    mean = snapshots.mean(axis=0) * (spec.centring == "affine")
    V, sigma = pod((snapshots - mean).T)
    noise = float(np.linalg.norm([group.roundoff(y) for _, y in states]))
    return TrainedBasis(snapshots, mean, V[:, : numerical_rank(sigma, V.shape, noise)])


def block_deim(
    group: ConstraintGroup, columns: Columns, basis: TrainedBasis, spec: InterpolationSpec
) -> Interpolation:
    """Interpolation of a group's projections with the first ``spec.modes`` modes of ``basis``.

    Raises
    ------
    SamplingError
        The gain exceeds ``spec.refuse_above``, or the sampled elements do not determine the basis.
    """
    strain, stiffness = reduced_strain(group, columns)
    snapshots, mean, V = basis.snapshots, basis.mean, basis.V[:, : spec.modes]
    if V.shape[1] == 0:
        offset = strain.T @ (group.row_weights[:, None] * mean.reshape(-1, 3))
        return Interpolation.of_constant(stiffness, offset)
    size = 3 * group.rows_per_element
    elements = np.sort(select_elements(V, size, spec))
    entries = element_rows(elements, size)
    operator = solution_operator(V[entries], "qr", 0.0)
    gain = norm_and_condition(V[entries], operator)[0]
    check_gain(group.name, gain, len(elements), spec)
    modes = _lift(strain, group.row_weights, V)
    if spec.test == "interpolated":
        modes = _galerkin_lift(group, strain, V, elements, operator)
    offset = strain.T @ (group.row_weights[:, None] * mean.reshape(-1, 3))
    offset -= (modes @ (operator @ mean[entries])).reshape(-1, 3)
    lower, upper = coefficient_bounds(snapshots[:, entries] @ operator.T, spec.margin)
    residual = spec.interpolates != "projection"
    return Interpolation(elements, operator, modes, offset, stiffness, gain, residual, lower, upper)


def training_snapshots(group: ConstraintGroup, states: States, residual: bool) -> np.ndarray:
    """Projections p of ``group``, or p - S y (``residual``), at all ``states``: (n, 3 e p)."""
    if len(states) == 0:
        raise SnapshotError(f"block-deim: group '{group.name}': no training states")
    rows = []
    for start, y in states:
        group.begin_frame(start)
        p = group.project(y)
        rows.append((p - group.S @ y if residual else p).ravel())
    return np.stack(rows)


def select_elements(V: np.ndarray, size: int, spec: InterpolationSpec) -> np.ndarray:
    """Greedy elements, one a mode, then others up to the oversampling and the gain of ``spec``.

    Parameters
    ----------
    V : (3 e p, r) basis
    size : 3 p, entries of an element
    """
    elements = oversample(V, size, block_elements(V, size), spec.oversampling * V.shape[1])
    return elements if spec.gain is None else bound_gain(V, size, elements, spec.gain)


def check_gain(group: str, gain: float, elements: int, spec: InterpolationSpec) -> None:
    """Check ``gain`` of so many ``elements`` of ``group`` against ``spec``; SamplingError above."""
    limit = np.inf if spec.refuse_above is None else spec.refuse_above
    if not np.isfinite(gain) or gain > limit:
        raise SamplingError(
            f"block-deim: group '{group}': gain {gain:.3g} of {elements} elements, allowed are "
            f"finite gains up to {limit:.3g} (more elements or fewer modes lower it)"
        )


def coefficient_bounds(
    coefficients: np.ndarray, margin: float | None
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Smallest and largest training coefficients (n, r), widened by ``margin`` of their range."""
    if margin is None:
        return None, None
    low, high = coefficients.min(axis=0), coefficients.max(axis=0)
    slack = margin * (high - low)
    return (low - slack)[:, None], (high + slack)[:, None]


def _lift(strain: np.ndarray, weights: np.ndarray, V: np.ndarray) -> np.ndarray:
    """B^T S^T W V for vectorised modes, (3 K, r)."""
    fields = (weights[:, None] * V.reshape(len(strain), -1)).reshape(len(strain), 3, -1)
    return np.tensordot(strain, fields, axes=(0, 0)).reshape(-1, V.shape[1])


def _galerkin_lift(
    group: ConstraintGroup,
    strain: np.ndarray,
    V: np.ndarray,
    elements: np.ndarray,
    operator: np.ndarray,
) -> np.ndarray:
    """(V operator P^T S B)^T W V: the strains of the test functions are interpolated, too."""
    gram = V.T @ (np.repeat(group.row_weights, 3)[:, None] * V)
    sampled = strain[element_rows(elements, group.rows_per_element)]
    return _lift(sampled, np.ones(len(sampled)), operator.T @ gram)
