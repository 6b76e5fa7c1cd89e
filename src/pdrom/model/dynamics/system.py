"""The global system (M / h^2 + sum_j S_j^T W_j S_j) y = rhs, with held vertices eliminated."""

from collections.abc import Callable, Sequence
from copy import copy

import numpy as np
from scipy import sparse

from pdrom.core.errors import SolverError
from pdrom.core.store import require_finite
from pdrom.model.compiled.rows import empty, zeros
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics import solvers

DEFAULT_SOLVER = "supernodal"

# Largest accepted relative error of a solve; with a larger one, a body would move without a force.
ACCURACY = 1e-6


class Elimination:
    """Factored system without the vertices ``fixed``; x, y and z share one factorisation.

    factor : (panels, vertices, loads, x) for `sweeps.sweep`; None if the solver is not compiled
    coupling : (beside, indptr, indices, data) for `sweeps.load`
    """

    def __init__(self, matrix: sparse.csr_array, fixed: np.ndarray, solver: str) -> None:
        self.fixed = fixed
        self.free = np.setdiff1d(np.arange(matrix.shape[0]), fixed)
        coupling = sparse.csr_array(matrix[self.free][:, fixed]) if len(fixed) else None
        self._solver: solvers.SuperLUSolver | None = None
        self.factor: solvers.Factor | None = solvers.NOTHING_FREE
        self.coupling = solvers.NO_COUPLING
        if len(self.free):
            block = matrix if not len(fixed) else matrix[self.free][:, self.free]
            self._solver = solvers.SOLVERS[solver](sparse.csr_array(block), self.free, coupling)
            self.factor, self.coupling = self._solver.factor, self._solver.coupling
            require_accurate(block, self._solve_free)

    def for_run(self) -> "Elimination":
        """Return a copy with separate memory for targets and solves; it shares the factor."""
        own, own._solver = copy(self), copy(self._solver)
        if own._solver is not None and own.factor is not None:
            panels, order, loads, x = own.factor
            own.factor = own._solver.factor = panels, order, zeros(len(loads)), empty(len(x))
        return own

    def _solve_free(self, rhs: np.ndarray, out: np.ndarray) -> None:
        all_rhs, y = np.zeros((2, len(self.fixed) + len(self.free), 3))
        all_rhs[self.free] = rhs
        self.solve(all_rhs, y)
        out[...] = y[self.free]

    def set_targets(self, targets: np.ndarray) -> None:
        """Set the positions ``targets`` (n_fixed, 3) m of fixed vertices in the next solves."""
        if self._solver is not None:
            self._solver.set_targets(targets)

    def solve(self, rhs: np.ndarray, y: np.ndarray) -> None:
        """Overwrite free vertices' rows of ``y`` (N, 3) by the solution for ``rhs`` (N, 3)."""
        if self._solver is not None:
            self._solver.solve(rhs, y)


def require_accurate(matrix, solve: Callable[[np.ndarray, np.ndarray], object]) -> None:
    """Raise SolverError if ``solve`` does not reproduce a known solution for a ``matrix`` (n, n).

    ``solve`` gets a right-hand side (n, 3) and the array for the solution. The known solution is a
    translation, for which the terms of all elements cancel and those of inertia (and pins) remain.
    If the matrix has large rounding errors, these remaining terms are the first to be lost.
    """
    if matrix.shape[0] == 0:
        return
    known = np.ones((matrix.shape[0], 3))
    found = np.empty_like(known)
    solve(np.ascontiguousarray(matrix @ known), found)
    error = float(np.abs(found - known).max())
    if not error <= ACCURACY:
        raise SolverError(
            f"global system of size {len(known)}: a solve has the error {error:.1e} (allowed "
            f"{ACCURACY:g}): masses / time_step^2 are too small for the weights; reduce weights"
        )


class GlobalSystem:
    """Matrix of the global step, which is factored once for each set of fixed vertices."""

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
        """Number of factorisations computed so far."""
        return len(self._cache)

    def eliminate(self, fixed: np.ndarray) -> Elimination:
        """Return a system without the vertices ``fixed`` (ascending) for one run; cache factors."""
        key = np.ascontiguousarray(fixed, dtype=np.int64).tobytes()
        if key not in self._cache:
            self._cache[key] = Elimination(self.matrix, fixed, self._solver)
        return self._cache[key].for_run()
