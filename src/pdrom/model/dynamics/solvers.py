"""Factorisations of the global system: factor once, solve often."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from pdrom.core.errors import SolverError
from pdrom.core.registry import Registry
from pdrom.model.compiled import rows
from pdrom.model.dynamics.panels import Panels
from pdrom.model.dynamics.sweeps import load, sweep

SOLVERS = Registry(
    "solver",
    {
        "supernodal": "pdrom.model.dynamics.solvers:SupernodalSolver",
        "splu": "pdrom.model.dynamics.solvers:SuperLUSolver",
        "splu-columns": "pdrom.model.dynamics.solvers:ColumnOrderedSolver",
    },
)

# First arguments of `pdrom.model.dynamics.sweeps.sweep`: panels, vertices, loads, working array.
Factor = tuple[tuple[Any, ...], np.ndarray, np.ndarray, np.ndarray]
NOTHING_FREE: Factor = (
    (np.zeros(1, np.int32), *(np.zeros(1, np.int64),) * 2, np.zeros(0, np.int32), np.zeros(0), 0),
    np.zeros(0, np.int32),
    np.zeros(0),
    np.zeros(0),
)
# First arguments of `pdrom.model.dynamics.sweeps.load`, where no unknown has a held neighbour.
NO_COUPLING = (np.zeros(0, np.int64), np.zeros(1, np.int32), np.zeros(0, np.int32), np.zeros(0))


class SparseSolver(ABC):
    """A factored symmetric positive definite matrix.

    Parameters
    ----------
    matrix : (n, n)
    vertices : (n,) rows of the arrays (N, 3) that its unknowns are
    coupling : (n, m) to m held vertices, whose part is taken from the right-hand side; None: m = 0
    """

    factor: Factor | None = None
    """For a compiled loop; None if the solver is not compiled."""
    coupling = NO_COUPLING
    """To the held vertices, for a compiled loop."""

    @abstractmethod
    def __init__(
        self,
        matrix: sparse.csr_array,
        vertices: np.ndarray,
        coupling: sparse.csr_array | None = None,
    ) -> None: ...

    @abstractmethod
    def set_targets(self, targets: np.ndarray) -> None:
        """Hold the held vertices at ``targets`` (m, 3) in the solves that follow."""

    @abstractmethod
    def solve(self, rhs: np.ndarray, y: np.ndarray) -> None:
        """Overwrite the rows ``vertices`` of ``y`` (N, 3) by the solution for ``rhs`` (N, 3)."""


class SuperLUSolver(SparseSolver):
    """SciPy's SuperLU with a symmetric ordering and its own substitution."""

    ordering = "MMD_AT_PLUS_A"

    def __init__(
        self,
        matrix: sparse.csr_array,
        vertices: np.ndarray,
        coupling: sparse.csr_array | None = None,
    ) -> None:
        self._factor = factored(matrix, self.ordering)
        self._vertices, self._coupling = vertices, coupling
        self._load = np.zeros((len(vertices), 3))

    def set_targets(self, targets: np.ndarray) -> None:
        if self._coupling is not None:
            self._load = self._coupling @ targets

    def solve(self, rhs: np.ndarray, y: np.ndarray) -> None:
        y[self._vertices] = self._factor.solve(rhs[self._vertices] - self._load)


class ColumnOrderedSolver(SuperLUSolver):
    """SuperLU with another order of summation, to see what the order changes."""

    ordering = "COLAMD"


class SupernodalSolver(SparseSolver):
    """SuperLU's factor in panels, swept by compiled code with x, y and z in one pass.

    Attributes
    ----------
    panels : the factor
    factor : the first arguments of `sweep`
    """

    def __init__(
        self,
        matrix: sparse.csr_array,
        vertices: np.ndarray,
        coupling: sparse.csr_array | None = None,
    ) -> None:
        n = matrix.shape[0]
        factor = factored(matrix, "MMD_AT_PLUS_A")
        lower = sparse.csc_array(factor.L)
        lower.sort_indices()
        self.panels = Panels.of(lower, factor.U.diagonal())
        unknowns = np.argsort(factor.perm_c)
        order = vertices[unknowns].astype(np.int32)
        self._loads = rows.zeros(rows.WIDTH * n)
        self._sweep = (self.panels.factor, order, self._loads, rows.empty(rows.WIDTH * n))
        self.factor = self._sweep
        self.coupling = NO_COUPLING
        if coupling is not None:
            own = sparse.csr_array(coupling[unknowns])
            # few unknowns have a held neighbour
            beside = np.flatnonzero(np.diff(own.indptr))
            self.coupling = beside, own.indptr, own.indices, own.data

    def set_targets(self, targets: np.ndarray) -> None:
        if len(self.coupling[0]):
            load(*self.coupling, np.ascontiguousarray(targets), self._loads)

    def solve(self, rhs: np.ndarray, y: np.ndarray) -> None:
        right, solution = rows.flat(rhs), rows.flat(y)
        sweep(*self._sweep, right, solution)
        if not rows.shares(y, solution):
            y[...] = rows.unflat(solution)


def factored(matrix: sparse.csr_array, ordering: str) -> SuperLU:
    """SuperLU of a matrix (n, n) without pivoting; ``ordering`` as SuperLU's ``permc_spec``.

    Raises
    ------
    SolverError
        The matrix is singular or not positive definite.
    """
    size = matrix.shape[0]
    try:
        factor = splu(
            matrix.tocsc(),
            permc_spec=ordering,
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise SolverError(f"global system of size {size}: {error}") from error
    symmetric = ordering == "COLAMD" or np.array_equal(factor.perm_r, factor.perm_c)
    if not (symmetric and (factor.U.diagonal() > 0.0).all()):
        raise SolverError(f"global system of size {size}: not positive definite")
    return factor


def solver_class(name: str) -> type[SparseSolver]:
    """Class of the solver that is registered as ``name``."""
    return SOLVERS.load(name)
