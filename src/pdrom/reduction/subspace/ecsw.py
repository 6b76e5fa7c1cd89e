"""Energy-conserving sampling and weighting (Farhat et al. 2014) for projective dynamics.

A few elements with non-negative factors xi stand for all: sum_e xi_e g_e ~ sum_e g_e, where g_e is
what an element contributes to the reduced equations over the training iterates. The same factors
weight the element in the system matrix and in the right-hand side. The reduced problem is then
again a projective-dynamics problem, with weights xi_e w_e >= 0: whatever the factors and the state,
its objective cannot rise in an iteration. Their quality decides the accuracy, not the stability.
"""

from collections.abc import Iterator, Sequence
from itertools import groupby

import numpy as np
from numba import njit

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.nnls import nnls_path
from pdrom.reduction.subspace.training import TrainingFrame

# Rows that the training equations are hashed to, per coordinate of the subspace: several times the
# elements that are chosen, or the factors would fit the hashing and not the equations.
SKETCH = 60
# Elements that may be chosen, at first and at most: neighbours are much alike, and the equations
# of all elements of a large mesh fill the memory.
CANDIDATES, MOST = 5000, 20_000
SEED = 0


def ecsw_elements(
    group: ConstraintGroup,
    columns: Columns,
    training: Sequence[TrainingFrame],
    tolerances: Sequence[float],
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Sampled elements (m,) and their factors xi > 0 (m,) for each tolerance.

    Of a large group a random (seeded) part is eligible, twice as many where these miss a tolerance,
    up to `MOST`; the sum that they have to meet is always that of all elements.

    Parameters
    ----------
    tolerances : relative residuals tau of the training equations at which NNLS stops
    """
    count = CANDIDATES
    while True:
        eligible = _eligible(group.elements, count)
        rows, total = training_equations(group, columns, training, eligible)
        solutions = nnls_path(rows, total, tolerances)
        if count >= min(group.elements, MOST) or _met(rows, total, solutions, tolerances):
            return [(eligible[support], factors) for support, factors in solutions]
        count *= 2


def _eligible(elements: int, count: int) -> np.ndarray:
    if count >= elements:
        return np.arange(elements)
    return np.sort(np.random.default_rng(SEED).choice(elements, count, replace=False))


def _met(
    rows: np.ndarray,
    total: np.ndarray,
    solutions: Sequence[tuple[np.ndarray, np.ndarray]],
    tolerances: Sequence[float],
) -> bool:
    """Whether every solution keeps to its tolerance, but for round-off."""
    left = [np.linalg.norm(rows[:, support] @ x - total) for support, x in solutions]
    allowed = (1.0 + 1e-9) * np.linalg.norm(total) * np.array(tolerances)
    return bool((np.array(left) <= allowed).all())


def training_equations(
    group: ConstraintGroup,
    columns: Columns,
    training: Sequence[TrainingFrame],
    elements: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Training equations of ``elements`` (m, len(elements)) in Fortran order, and all sums (m,).

    For each pair (z, z') of iterates and each coordinate there is one equation,
    g_e = B^T S_e^T w_e (S_e B z' - p_e(B z)), in the norm of A^-1 (see module `training`),
    all together scaled so that the sum of all elements has norm 1. The share of the rest weight is
    one more equation: a group at rest (no force at all) still keeps its stiffness.

    Many equations are hashed to `SKETCH` K rows with random signs (seeded), which keeps norms of
    combinations up to a few per cent (count sketch, Charikar et al. 2002) and never forms an e x e
    matrix.
    """
    strain = np.ascontiguousarray(group.S @ columns.B)
    weighted = strain * group.row_weights[:, None]
    equations = sum(3 * len(frame.measure) * len(frame.pairs) for frame in training)
    size = min(SKETCH * strain.shape[1], equations)
    generator = np.random.default_rng(SEED)
    rows, sums, norm = np.zeros((len(elements), size + 1)), np.zeros(size + 1), 0.0
    shape = (group.elements, group.rows_per_element, -1)
    for measure, frames in _by_measure(training):
        lifted = weighted @ measure.T
        differences, targets = [], []
        for frame in frames:
            group.begin_frame(columns.B @ frame.start)
            for before, after in frame.pairs:
                difference = strain @ after - group.project(columns.B @ before)
                differences.append(difference.reshape(shape)[elements])
                sum_of_all = lifted.T @ difference
                norm += float(np.sum(sum_of_all**2))
                hashed = (
                    generator.integers(size, size=sum_of_all.shape),
                    generator.choice([-1.0, 1.0], size=sum_of_all.shape),
                )
                np.add.at(sums, hashed[0], hashed[1] * sum_of_all)
                targets.append(hashed)
        buckets, signs = (np.stack(part) for part in zip(*targets, strict=True))
        own = np.ascontiguousarray(lifted.reshape(shape)[elements])
        _hash_equations(own, np.stack(differences), buckets, signs, rows)
    if norm > 0.0:
        rows /= np.sqrt(norm)
        sums /= np.sqrt(norm)
    share = group.weights / group.weights.sum()
    rows[:, -1], sums[-1] = share[elements], 1.0
    return rows.T, sums


def _by_measure(
    training: Sequence[TrainingFrame],
) -> Iterator[tuple[np.ndarray, list[TrainingFrame]]]:
    """Frames that follow each other with the same measure, together."""
    for _, frames in groupby(training, key=lambda frame: id(frame.measure)):
        same = list(frames)
        yield same[0].measure, same


@njit(cache=True, error_model="numpy")
def _hash_equations(lifted, differences, buckets, signs, out):
    """Add each element's equations to the rows that they are hashed to.

    lifted : (m, p, K'), differences : (n, m, p, 3), buckets, signs : (n, K', 3), out : (m, size)
    """
    for e in range(out.shape[0]):
        for n in range(differences.shape[0]):
            for k in range(lifted.shape[2]):
                for axis in range(3):
                    value = 0.0
                    for row in range(lifted.shape[1]):
                        value += lifted[e, row, k] * differences[n, e, row, axis]
                    out[e, buckets[n, k, axis]] += signs[n, k, axis] * value
