"""Energy-conserving sampling and weighting (Farhat et al. 2014) for projective dynamics.

A few elements with non-negative factors xi stand for all: sum_e xi_e g_e ~ sum_e g_e, where g_e is
what an element contributes to the reduced equations over the training states. The same factors
weight the element in the system matrix and in the right-hand side. The reduced problem is then
again a projective-dynamics problem, with weights xi_e w_e >= 0: whatever the factors and the state,
its objective cannot rise in an iteration. Their quality decides the accuracy, not the stability.
"""

import numpy as np

from pdrom.constraints.base import ConstraintGroup
from pdrom.subspace.columns import Columns
from pdrom.subspace.nnls import nnls_early_stop

# Rows that the training equations are hashed to.
SKETCH = 1500
SEED = 0


def ecsw_elements(
    group: ConstraintGroup,
    columns: Columns,
    states: np.ndarray,
    tolerance: float,
    most: int | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Sampled elements (m,) and their factors xi > 0 (m,).

    Parameters
    ----------
    states : (n, N, 3) training positions, already in the subspace
    tolerance : relative residual tau of the training equations at which NNLS stops
    """
    rows = training_rows(group, columns, states)
    return nnls_early_stop(rows, rows.sum(axis=1), tolerance, most)


def training_rows(
    group: ConstraintGroup, columns: Columns, states: np.ndarray, sketch: int = SKETCH
) -> np.ndarray:
    """Training equations, one column per element, (at most sketch, e).

    For each training state y and each coordinate there are the elastic force
    B^T S_e^T w_e (S_e y - p_e(y)) and the elastic stiffness B^T S_e^T w_e S_e y, each kind scaled
    by the norm of its sum, so that the fixed point and the way to it count alike. The share of the
    rest weight is one more equation: a group at rest (no force at all) still keeps its stiffness.

    Many equations are hashed to ``sketch`` rows with random signs (seeded), which keeps norms of
    combinations up to a few per cent (count sketch, Charikar et al. 2002) and never forms an e x e
    matrix.
    """
    e, p = group.elements, group.rows_per_element
    k = columns.B.shape[1]
    strain = (group.S @ columns.B).reshape(e, p, k)
    strain *= group.weights[:, None, None]
    generator = np.random.default_rng(SEED)
    size = min(sketch, 3 * k * len(states))
    kinds = [np.zeros((size, e)), np.zeros((size, e))]
    totals = [0.0, 0.0]
    for y in states:
        group.begin_frame(y)
        d = (group.S @ y).reshape(e, p, 3)
        residual = d - group.project(y).reshape(e, p, 3)
        buckets = generator.integers(size, size=3 * k)
        signs = generator.choice([-1.0, 1.0], size=3 * k)
        for kind, value in enumerate((residual, d)):
            rows = np.einsum("epk,epa->kae", strain, value, optimize=True).reshape(3 * k, e)
            totals[kind] += float(np.sum(rows.sum(axis=1) ** 2))
            np.add.at(kinds[kind], buckets, signs[:, None] * rows)
    scaled = [r / np.sqrt(t) if t > 0.0 else r for r, t in zip(kinds, totals, strict=True)]
    measure = (group.weights / group.weights.sum())[None, :]
    return np.vstack([*scaled, measure])
