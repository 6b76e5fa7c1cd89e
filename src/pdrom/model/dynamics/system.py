"""The global system (M / h^2 + sum_j S_j^T W_j S_j) y = rhs with exactly eliminated vertices."""

from collections.abc import Callable, Sequence

import numpy as np
from numba import njit
from scipy import sparse

from pdrom.core.errors import SolverError
from pdrom.core.store import require_finite
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.solvers import SparseSolver, solver_class

DEFAULT_SOLVER = "cholespy"

# A solve that keeps fewer digits than this would move a body that nothing pushes.
ACCURACY = 1e-6


class Elimination:
    """The system with a fixed set of vertices taken out; one factorisation serves x, y and z."""

    def __init__(self, matrix: sparse.csr_array, fixed: np.ndarray, solver: str) -> None:
        self.fixed = fixed
        self.free = np.setdiff1d(np.arange(matrix.shape[0]), fixed)
        self._coupling = matrix[self.free][:, fixed] if len(fixed) else None
        self._rhs = np.empty((len(self.free), 3))
        self._solution = np.empty((len(self.free), 3))
        self._load = np.zeros((len(self.free), 3))
        self._solver: SparseSolver | None = None
        if len(self.free):
            block = matrix if not len(fixed) else matrix[self.free][:, self.free]
            self._solver = solver_class(solver)(sparse.csr_array(block))
            require_accurate(block, self._solver.solve)

    def set_targets(self, targets: np.ndarray) -> None:
        """Positions (n_fixed, 3) of the fixed vertices for the solves that follow."""
        if self._coupling is not None:
            self._load = self._coupling @ targets

    def solve(self, rhs: np.ndarray, y: np.ndarray) -> None:
        """Overwrite the free rows of ``y`` (N, 3) with the solution for ``rhs`` (N, 3)."""
        if self._solver is None:
            return
        if self._coupling is None:
            self._solver.solve(rhs, y)
            return
        _take_less(rhs, self.free, self._load, self._rhs)
        self._solver.solve(self._rhs, self._solution)
        _put(self._solution, self.free, y)


@njit(cache=True)
def _take_less(values, rows, less, out):
    for i in range(len(rows)):
        for axis in range(3):
            out[i, axis] = values[rows[i], axis] - less[i, axis]


@njit(cache=True)
def _put(values, rows, out):
    for i in range(len(rows)):
        for axis in range(3):
            out[rows[i], axis] = values[i, axis]


def require_accurate(matrix, solve: Callable[[np.ndarray, np.ndarray], object]) -> None:
    """Raise SolverError if the factored ``matrix`` (n, n) does not return a known solution.

    The known solution is a translation: all springs and elements cancel in it and nothing but
    inertia (and pins) is left, which rounding in the matrix loses first.
    """
    if matrix.shape[0] == 0:
        return
    known = np.ones((matrix.shape[0], 3))
    found = np.empty_like(known)
    solve(np.ascontiguousarray(matrix @ known), found)
    error = float(np.abs(found - known).max())
    if not error <= ACCURACY:
        raise SolverError(
            f"global system of size {len(known)}: a solve is wrong by {error:.1e}, allowed is "
            f"{ACCURACY:g}: masses over the squared time step are round-off beside the weights"
        )


class GlobalSystem:
    """Matrix of the global step; eliminations are factored once per set of fixed vertices."""

    def __init__(
        self,
        masses: np.ndarray,
        time_step: float,
        groups: Sequence[ConstraintGroup],
        solver: str = DEFAULT_SOLVER,
    ) -> None:
        self.inertia = masses / time_step**2
        matrix = sparse.csr_array(sparse.diags_array(self.inertia))
        for group in groups:
            matrix = matrix + group.system_matrix()
        self.matrix = sparse.csr_array(matrix)
        require_finite("global system", self.matrix.data, SolverError)
        self._solver = solver
        self._cache: dict[bytes, Elimination] = {}

    @property
    def factorisations(self) -> int:
        """How many factorisations exist so far."""
        return len(self._cache)

    def eliminate(self, fixed: np.ndarray) -> Elimination:
        """The system without the vertices ``fixed`` (ascending), from the cache if known."""
        key = np.ascontiguousarray(fixed, dtype=np.int64).tobytes()
        if key not in self._cache:
            self._cache[key] = Elimination(self.matrix, fixed, self._solver)
        return self._cache[key]
