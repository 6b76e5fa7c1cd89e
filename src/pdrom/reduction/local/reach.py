"""Reach of a reduction: the largest static displacement that its projections can cause."""

import numpy as np
from scipy import linalg

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.reduction.sampling.reduction import Reduction


def reach(
    group: ConstraintGroup, reduction: Reduction, largest: np.ndarray, compliance: np.ndarray
) -> float:
    """Bound of | S^T W (p^ - mean) |_{K^+} over all states, J^1/2; inf if p^ does not exist.

    Coefficients are taken as not clipped.

    The sampled projections p_e lie in balls of radius ``largest``, so that those of the m sampled
    elements minus the mean, divided by sqrt(m) times their radii, lie in the unit ball together:
    what remains is the 2-norm of K^{+1/2} S^T W V (P^T V)^+ with its columns scaled so.

    Parameters
    ----------
    largest : (e,) bounds of | p_e |_F, see `study.experiments.kit.boundedness.largest_projections`
    compliance : (N, N) K^+, m/N
    """
    mean = np.linalg.norm(reduction.basis.mean.reshape(group.elements, -1), axis=1)
    radii = np.repeat(largest + mean, 3 * group.rows_per_element)
    lift = lifted_modes(group, reduction)
    size, total = 3 * group.rows_per_element, 0.0
    for block, columns in zip(reduction.blocks, lift, strict=True):
        if not np.isfinite(block.operator).all():
            return np.inf
        sampled = len(np.unique(block.entries // size))
        scaled = block.operator * (np.sqrt(sampled) * radii[block.entries])
        square = sum(columns[:, a].T @ (compliance @ columns[:, a]) for a in range(3))
        total += _product_norm(square, scaled @ scaled.T)
    return float(np.sqrt(total))


def lifted_modes(group: ConstraintGroup, reduction: Reduction) -> list[np.ndarray]:
    """S^T W V of each coefficient block of ``group``'s ``reduction`` as fields (N, 3, r)."""
    lift = group.S.T.multiply(group.row_weights[None, :]).tocsr()
    fields = []
    for block in reduction.blocks:
        modes = reduction.v[block.output].reshape(lift.shape[1], -1)
        field = np.zeros((lift.shape[0], 3, reduction.r))
        axes = slice(None) if block.axis is None else slice(block.axis, block.axis + 1)
        field[:, axes] = (lift @ modes).reshape(lift.shape[0], -1, reduction.r)
        fields.append(field)
    return fields


def _product_norm(first: np.ndarray, second: np.ndarray) -> float:
    """Largest eigenvalue of the product of two positive semidefinite matrices (r, r)."""
    values, vectors = linalg.eigh(0.5 * (first + first.T))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return float(max(linalg.eigvalsh(root.T @ second @ root)[-1], 0.0))
