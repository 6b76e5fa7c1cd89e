"""Contraction of a small error by an iteration with reduced projections.

A local/global iteration maps an error d of the iterate to T d, T = A^-1 S^T W R J S, with the
matrix A = M/h^2 + S^T W S of the free vertices, the derivative J of the projections and the linear
part R of their reduction (R = V (P^T V)^+ P^T; the identity in the full order). Two numbers
describe it: the contraction number |T|_A = |A^-1/2 S^T W R J S A^-1/2|_2, which is how much one
iteration may enlarge an error in the energy of its quadratic objective, and the spectral radius of
T, which decides in the long run. T has the rank of the reduction, so that both are numbers of r x r
matrices.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, sparse

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.reduction.local.reach import lifted_modes
from pdrom.reduction.sampling.reduction import Reduction

# Step of the central differences, relative to the largest entry of S q.
STEP = 1e-6


@dataclass(frozen=True)
class Tangent:
    """A state at which projections are linearised.

    inverse : (N, N) A^-1 with the held vertices eliminated (zero rows and columns), m/N
    strain : (3 e p, 3 N) CSR, J (S x I_3)
    """

    inverse: np.ndarray
    strain: sparse.csr_array

    @classmethod
    def at(
        cls,
        group: ConstraintGroup,
        matrix: np.ndarray,
        held: np.ndarray,
        start: np.ndarray,
        state: np.ndarray,
    ) -> "Tangent":
        """Tangent in the frame from ``start`` to ``state``, both (N, 3) m.

        Parameters
        ----------
        matrix : (N, N) A
        held : vertices held in the frame, ascending
        """
        free = np.setdiff1d(np.arange(len(matrix)), held)
        inverse = np.zeros_like(matrix)
        inverse[np.ix_(free, free)] = linalg.inv(matrix[np.ix_(free, free)])
        group.begin_frame(start)
        blocks = _derivatives(group, state)
        e = np.arange(group.elements + 1)
        derivative = sparse.bsr_array((blocks, e[:-1], e)).tocsr()
        strain = sparse.kron(group.S, sparse.eye_array(3), format="csr")
        return cls(inverse, sparse.csr_array(derivative @ strain))


def iteration_numbers(
    group: ConstraintGroup, reduction: Reduction, tangents: Sequence[Tangent]
) -> tuple[float, float]:
    """Contraction number and spectral radius of ``group`` reduced, largest over ``tangents``.

    inf where the reduction does not exist. Clipped coefficients (``bounds`` of the method) are
    taken as free: clipping does not enlarge differences.
    """
    if not all(np.isfinite(block.operator).all() for block in reduction.blocks):
        return np.inf, np.inf
    # the blocks side by side: columns L (N, 3, n) and rows G (n, 3 N)
    lift = np.concatenate(lifted_modes(group, reduction), axis=2)
    pairs = [_numbers(lift, reduction, tangent) for tangent in tangents]
    contraction, radius = np.max(pairs, axis=0)
    return float(contraction), float(radius)


def _numbers(lift: np.ndarray, reduction: Reduction, tangent: Tangent) -> tuple[float, float]:
    vertices, _, n = lift.shape
    sampled = np.vstack([b.operator @ tangent.strain[b.entries] for b in reduction.blocks])
    answer = (tangent.inverse @ lift.reshape(vertices, -1)).reshape(3 * vertices, n)
    radius = np.abs(linalg.eigvals(sampled @ answer)).max()
    rows = sampled.reshape(n, vertices, 3).transpose(1, 0, 2).reshape(vertices, -1)
    outer = (tangent.inverse @ rows).reshape(vertices, n, 3).transpose(1, 0, 2)
    outer = sampled.reshape(n, vertices, 3).reshape(n, -1) @ outer.reshape(n, -1).T
    inner = lift.reshape(3 * vertices, n).T @ answer
    values, vectors = linalg.eigh(0.5 * (inner + inner.T))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    square = linalg.eigvalsh(root.T @ (0.5 * (outer + outer.T)) @ root)[-1]
    return float(np.sqrt(max(square, 0.0))), float(radius)


def _derivatives(group: ConstraintGroup, state: np.ndarray) -> np.ndarray:
    """Derivative of each element's projection by its S_e q, (e, 3p, 3p), central differences."""
    shape = (group.elements, group.rows_per_element, 3)
    strain, elements = (group.S @ state).reshape(shape), np.arange(group.elements)
    step = STEP * float(np.abs(strain).max())
    size = 3 * group.rows_per_element
    derivative = np.empty((group.elements, size, size))
    for column in range(size):
        moved = np.zeros(shape[1:])
        moved.flat[column] = step
        ahead = group.reference_project(strain + moved, elements)
        behind = group.reference_project(strain - moved, elements)
        derivative[:, :, column] = ((ahead - behind) / (2.0 * step)).reshape(shape[0], size)
    return derivative
