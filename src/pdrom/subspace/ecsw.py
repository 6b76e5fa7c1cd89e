"""Energy-conserving sampling and weighting (Farhat et al. 2014) for projective dynamics.

A few elements with non-negative factors xi stand for all: sum_e xi_e g_e ~ sum_e g_e, where g_e is
what an element contributes to the reduced equations over the training states. The same factors
weight the element in the system matrix and in the right-hand side. The reduced problem is then
again a projective-dynamics problem, with weights xi_e w_e >= 0: whatever the factors and the state,
its objective cannot rise in an iteration. Their quality decides the accuracy, not the stability.
"""

import numpy as np
from scipy import linalg

from pdrom.constraints.base import ConstraintGroup
from pdrom.subspace.columns import Columns
from pdrom.subspace.nnls import nnls_early_stop


def training_columns(
    group: ConstraintGroup, columns: Columns, states: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Contributions of each element to the reduced equations, as columns.

    Rows are, for each training state y and each coordinate, the elastic force
    B^T S_e^T w_e (S_e y - p_e(y)) and the elastic stiffness B^T S_e^T w_e S_e y, each scaled by the
    norm of its sum, so that the fixed point and the way to it count alike.

    Parameters
    ----------
    states : (n, N, 3) positions

    Returns
    -------
    forces, stiffnesses
        Each (3 n K, e), already scaled.
    """
    e, p = group.elements, group.rows_per_element
    k = columns.B.shape[1]
    strain = (group.S @ columns.B).reshape(e, p, k)
    forces = np.empty((len(states), k, 3, e))
    stiffnesses = np.empty_like(forces)
    for t, y in enumerate(states):
        group.begin_frame(y)
        d = (group.S @ y).reshape(e, p, 3)
        residual = d - group.project(y).reshape(e, p, 3)
        weighted = strain * group.weights[:, None, None]
        forces[t] = np.einsum("epk,epa->kae", weighted, residual, optimize=True)
        stiffnesses[t] = np.einsum("epk,epa->kae", weighted, d, optimize=True)
    return _scaled(forces.reshape(-1, e)), _scaled(stiffnesses.reshape(-1, e))


def _scaled(rows: np.ndarray) -> np.ndarray:
    norm = np.linalg.norm(rows.sum(axis=1))
    return rows / norm if norm > 0.0 else rows


def compress(rows: np.ndarray, tolerance: float) -> np.ndarray:
    """Fewer rows with the same column geometry: the leading left singular directions.

    ``rows`` (m, e) is replaced by U^T rows with U from the Gram matrix rows rows^T (m, m), which
    never forms an e x e matrix. Directions below ``tolerance`` times the norm of the row sum are
    left out.
    """
    values, vectors = linalg.eigh(rows @ rows.T)
    target = rows.sum(axis=1)
    order = np.argsort(values)[::-1]
    values, vectors = np.maximum(values[order], 0.0), vectors[:, order]
    # what is dropped must be small for every non-negative combination of moderate factors
    level = np.sqrt(values[0]) * max(tolerance * 1e-3, 1e-8)
    keep = np.sqrt(values) > level
    keep |= np.abs(vectors.T @ target) > 0.1 * tolerance * np.linalg.norm(target)
    return vectors[:, keep].T @ rows


def ecsw_elements(
    group: ConstraintGroup,
    columns: Columns,
    states: np.ndarray,
    tolerance: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Sampled elements (m,) and their factors xi > 0 (m,).

    The mean of the elements' contributions to the total rest weight is kept as one more equation,
    so that a group at rest (no force at all) still keeps its stiffness.
    """
    forces, stiffnesses = training_columns(group, columns, states)
    measure = (group.weights / group.weights.sum())[None, :]
    rows = compress(np.vstack([forces, stiffnesses, measure]), tolerance)
    return nnls_early_stop(rows, rows.sum(axis=1), tolerance)
