"""Projected Newton with a sparse direct solver (Teran et al. 2005) for the objective of a frame.

The Hessian of an element is known in closed form and made positive semidefinite, so that every
direction descends; steps are shortened until the objective falls enough. Where elements are inside
their range the Hessian has nothing but inertia, and a step runs far into the stiff part beyond. If
few halvings do not help, the eigenvalues of the elements are raised to a floor, and to a higher one
(Levenberg and Marquardt's way); at the floor 1 the step is that of the local/global iteration,
which cannot rise. The floor of a step is where the next one begins, a tenth of it.
"""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pdrom.core.errors import SolverError
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.constraints.lanes import lane_function
from pdrom.model.dynamics.frames import inertia_energy
from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.elements import (
    MODES,
    Elements,
    decompose_element,
    hessian,
    workspace,
)
from study.experiments.alternatives.solvers.substeps import (
    Alternative,
    Substeps,
    add_projections,
    begin,
    end,
    multiply,
)

SUFFICIENT = 1e-4  # Armijo's constant
HALVINGS = 3  # of a step, before the floor is raised
FIRST, TENFOLD = 1e-3, 10.0  # lowest floor but zero, and the factor to the next
NOISE = 2e-15  # relative error of the objective


class Newton(Alternative):
    """For springs, triangle strain and tetrahedra; an iteration factors the Hessian once."""

    name = "newton"

    def _prepare(self, scene: Scene) -> None:
        self._elements = Elements.of(scene, self.name)
        self._patterns: dict[bytes, _Pattern] = {}

    def _advance(self, part: Substeps) -> None:
        y, v, acceleration, step, substeps, _, fixed, targets = part
        key = fixed.tobytes()
        if key not in self._patterns:
            self._patterns[key] = _Pattern(self._elements, self.space.system.matrix, fixed)
        before, s = np.empty_like(y), np.empty_like(y)
        for _ in range(substeps):
            begin(y, v, acceleration, step, fixed, targets, before, s)
            self._minimise(y, s, self._patterns[key])
            end(y, before, step, v)

    def _minimise(self, y: np.ndarray, s: np.ndarray, pattern: "_Pattern") -> None:
        value, gradient = self._evaluate(y, s)
        floor = 0.0
        for _ in range(self.iterations):
            while True:
                step = pattern.solve(y, self.space.system.inertia, gradient, floor)
                direction = np.zeros_like(y)
                direction.reshape(-1, WIDTH)[pattern.free, :3] = -step
                found = self._search(y, s, direction, value, gradient)
                if found is not None:
                    break
                if floor == 1.0:
                    return  # round-off: nothing is lower
                floor = min(max(TENFOLD * floor, FIRST), 1.0)
            value, gradient = found
            floor = floor / TENFOLD if floor > FIRST else 0.0

    def _search(
        self,
        y: np.ndarray,
        s: np.ndarray,
        direction: np.ndarray,
        value: float,
        gradient: np.ndarray,
    ) -> tuple[float, np.ndarray] | None:
        """Move ``y`` to where the objective is lower; its value and gradient there, or None."""
        slope = float(direction @ gradient)
        for halving in range(HALVINGS + 1):
            length = 0.5**halving
            trial = y + length * direction
            found, after = self._evaluate(trial, s)
            if found <= value + SUFFICIENT * length * slope + NOISE * abs(value):
                y[:] = trial
                return found, after
        return None

    def _evaluate(self, y: np.ndarray, s: np.ndarray) -> tuple[float, np.ndarray]:
        """The objective and its gradient, held vertices included."""
        gradient, inertia = np.empty_like(y), self.space.system.inertia
        value = _evaluate(y, s, inertia, self.potential.tables, self.potential.stiffness, gradient)
        return value, gradient


@compiled(nogil=True)
def _evaluate(y, s, inertia, tables, stiffness, gradient):
    pull = np.zeros(len(y))
    energy = add_projections(tables, y, pull)
    multiply(stiffness, y, gradient)
    for i in range(len(inertia)):
        for k in range(WIDTH * i, WIDTH * i + 3):
            gradient[k] += inertia[i] * (y[k] - s[k]) - pull[k]
    return energy + inertia_energy(y, s, inertia)


class _Pattern:
    """Places of the entries of the Hessian of the free vertices, in an order that fills in little.

    free : (n,) vertices in that order, which is found once
    """

    def __init__(self, elements: Elements, matrix: sparse.csr_array, fixed: np.ndarray) -> None:
        self._elements = elements
        n = matrix.shape[0]
        kept = np.setdiff1d(np.arange(n), fixed)
        own = sparse.csc_array(matrix[kept][:, kept])
        order = np.argsort(
            splu(own, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).perm_c
        )
        self.free = kept[order]
        graph = sparse.csr_array(matrix[self.free][:, self.free])
        graph.sort_indices()
        self._indptr, self._indices = graph.indptr, graph.indices
        self._row = np.full(n, -1)
        self._row[self.free] = np.arange(len(self.free))
        # the transposed of a symmetric matrix by rows is the matrix by columns
        numbers = np.arange(9 * graph.nnz, dtype=float).reshape(-1, 3, 3)
        blocks = sparse.bsr_array((numbers, graph.indices, graph.indptr)).tocsr()
        self._take = blocks.data.astype(np.int64)
        self._starts, self._places = blocks.indptr, blocks.indices

    def solve(
        self, y: np.ndarray, inertia: np.ndarray, gradient: np.ndarray, floor: float
    ) -> np.ndarray:
        """H^-1 gradient of the free vertices, (n, 3); SolverError if H is singular."""
        blocks = np.zeros((len(self._indices), 3, 3))
        _assemble(
            y, inertia, floor, self._elements.arrays, workspace(), self._row, self._indptr,
            self._indices, blocks,
        )  # fmt: skip
        size = 3 * len(self.free)
        entries = blocks.ravel()[self._take]
        matrix = sparse.csc_array((entries, self._places, self._starts), shape=(size, size))
        try:
            factor = splu(
                matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise SolverError(f"Hessian of size {size}: {error}") from error
        return factor.solve(gradient.reshape(-1, WIDTH)[self.free, :3].ravel()).reshape(-1, 3)


@lane_function
def _place(indptr, indices, row, column):
    """Place of an entry of the pattern."""
    low, high = indptr[row], indptr[row + 1]
    while low < high:
        middle = (low + high) // 2
        if indices[middle] < column:
            low = middle + 1
        else:
            high = middle
    return low


@compiled(nogil=True)
def _assemble(y, inertia, floor, elements, work, own_row, indptr, indices, blocks):
    """Add the projected Hessians of all elements, and the inertia, to the pattern's blocks."""
    rows, corners, operator, weights, low, high, fallback = elements
    d, u, v, sigma = work
    values, modes, part = np.zeros(MODES), np.zeros((MODES, 3, 3)), np.zeros((4, 3))
    for vertex in range(len(own_row)):
        row = own_row[vertex]
        if row >= 0:
            place = _place(indptr, indices, row, row)
            for k in range(3):
                blocks[place, k, k] += inertia[vertex]
    for e in range(len(rows)):
        p = rows[e]
        decompose_element(y, e, p, corners, operator, fallback, d, u, v, sigma)
        for n in range(hessian(u, v, sigma, p, low[e], high[e], floor, values, modes)):
            for corner in range(p + 1):
                for k in range(3):
                    part[corner, k] = 0.0
                    for row in range(p):
                        part[corner, k] += operator[e, row, corner] * modes[n, row, k]
            for a in range(p + 1):
                row = own_row[corners[e, a]]
                for b in range(p + 1):
                    column = own_row[corners[e, b]]
                    if row >= 0 and column >= 0:
                        place = _place(indptr, indices, row, column)
                        for k in range(3):
                            factor = weights[e] * values[n] * part[a, k]
                            for m in range(3):
                                blocks[place, k, m] += factor * part[b, m]
