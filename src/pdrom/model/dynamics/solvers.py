"""Sparse Cholesky backends for the global step, factor once and solve often."""

import logging
from abc import ABC, abstractmethod
from importlib.util import find_spec

import numpy as np
from scipy import sparse

from pdrom.core.errors import SolverError
from pdrom.core.registry import Registry

SOLVERS = Registry(
    "solver",
    {
        "cholespy": "pdrom.model.dynamics.solvers:CholespySolver",
        "splu": "pdrom.model.dynamics.solvers:SuperLUSolver",
        "splu-columns": "pdrom.model.dynamics.solvers:ColumnOrderedSolver",
    },
)


log = logging.getLogger(__name__)


def solver_class(name: str) -> "type[SparseSolver]":
    """Class of a registered solver.

    Where cholespy is not installed (it has no wheel for Linux on ARM), SciPy's solver takes its
    place, and every log says so.
    """
    if name == "cholespy" and find_spec("cholespy") is None:
        log.warning("cholespy is not installed: SciPy's SuperLU solves the global system instead")
        return SuperLUSolver
    return SOLVERS.load(name)


class SparseSolver(ABC):
    """Factorisation of a symmetric positive definite matrix (n, n)."""

    @abstractmethod
    def __init__(self, matrix: sparse.csr_array) -> None: ...

    @abstractmethod
    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        """Solve for the columns of ``rhs`` (n, 3), C order, into ``out`` (n, 3)."""


class CholespySolver(SparseSolver):
    """CHOLMOD through cholespy: three right-hand sides in one pass."""

    def __init__(self, matrix: sparse.csr_array) -> None:
        from cholespy import CholeskySolverD, MatrixType

        coo = matrix.tocoo()
        rows, columns = (np.ascontiguousarray(i, dtype=np.int32) for i in (coo.row, coo.col))
        try:
            self._solver = CholeskySolverD(
                matrix.shape[0], rows, columns, np.ascontiguousarray(coo.data), MatrixType.COO
            )
        except (ValueError, RuntimeError) as error:
            raise SolverError(f"global system of size {matrix.shape[0]}: {error}") from error

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        self._solver.solve(rhs, out)


class SuperLUSolver(SparseSolver):
    """SciPy's SuperLU with a symmetric ordering; needs no further package."""

    ordering = "MMD_AT_PLUS_A"

    def __init__(self, matrix: sparse.csr_array) -> None:
        from scipy.sparse.linalg import splu

        try:
            self._factor = splu(
                matrix.tocsc(),
                permc_spec=self.ordering,
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise SolverError(f"global system of size {matrix.shape[0]}: {error}") from error

    def solve(self, rhs: np.ndarray, out: np.ndarray) -> None:
        out[...] = self._factor.solve(rhs)


class ColumnOrderedSolver(SuperLUSolver):
    """The same with another order of summation, to see what the order changes."""

    ordering = "COLAMD"
