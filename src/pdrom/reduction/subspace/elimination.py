"""The small dense system of a position subspace with fixed coordinates eliminated."""

import numpy as np
from scipy import linalg

from pdrom.core.errors import SolverError
from pdrom.model.dynamics.system import require_accurate


class DenseElimination:
    """Reduced system with fixed coordinates eliminated; the inverse is small and explicit.

    Parameters
    ----------
    matrix : (K, K) of the reduced system, kg/s^2
    fixed : coordinates (m,) that have targets, ascending

    Raises
    ------
    SolverError
        The block of the free coordinates is not positive definite, or its solution inaccurate.
    """

    def __init__(self, matrix: np.ndarray, fixed: np.ndarray) -> None:
        self.free = np.setdiff1d(np.arange(len(matrix)), fixed)
        block = matrix[np.ix_(self.free, self.free)]
        try:
            factor = linalg.cho_factor(block)
        except linalg.LinAlgError as error:
            raise SolverError(f"reduced system of size {len(self.free)}: {error}") from error
        self._inverse = np.ascontiguousarray(linalg.cho_solve(factor, np.eye(len(self.free))))
        require_accurate(block, lambda rhs, out: np.matmul(self._inverse, rhs, out=out))
        self._coupling = np.ascontiguousarray(matrix[np.ix_(self.free, fixed)])
        self.fixed, self.targets = fixed, np.zeros((len(fixed), 3))
        self._load = np.zeros((len(self.free), 3))

    def set_targets(self, targets: np.ndarray) -> None:
        """Set the values ``targets`` (m, 3) of the fixed coordinates."""
        self.targets = targets
        self._load = self._coupling @ targets

    def solve(self, rhs: np.ndarray, y: np.ndarray) -> None:
        """Overwrite the free coordinates of ``y`` (K, 3) by the solution for ``rhs`` (K, 3)."""
        y[self.free] = self.solved(rhs)

    def solved(self, rhs: np.ndarray) -> np.ndarray:
        """Free coordinates that belong to ``rhs`` (K, 3)."""
        return self._inverse @ (rhs[self.free] - self._load)

    def response(self, inertia: np.ndarray) -> np.ndarray:
        """Free coordinates (K', K) to all of s, the fixed ones of which are at their targets.

        This is the solve for ``inertia`` s, (K, K) M/h^2, with the load of the targets.
        """
        result = self._inverse @ inertia[self.free]
        result[:, self.fixed] -= self._inverse @ self._coupling
        return result

    def lift(self, rows: np.ndarray) -> np.ndarray:
        """Response (m, K') of the free coordinates to a unit force on each of ``rows`` (m, K)."""
        return rows[:, self.free] @ self._inverse
