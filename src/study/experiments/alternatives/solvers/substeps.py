"""A frame in equal substeps, between the same held vertices and contacts as in the step loop.

The potential energy of all groups, W(y) = sum_j 1/2 sum_e w_e |S_e y - p_e(y)|^2, has the gradient
S^T W S y - S^T W p(y), because p is the nearest point: what moves p moves along the manifold
(Bouaziz et al. 2014, sect. 3).
"""

from abc import abstractmethod
from collections.abc import Callable, Sequence
from time import perf_counter
from typing import ClassVar, NamedTuple

import numpy as np
from scipy import sparse

from pdrom.core.errors import SceneError
from pdrom.core.registry import Registry
from pdrom.model.compiled.arithmetic import add_scaled, constant
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, as_vertices, at, flat, load, store
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.constraints.local_kernel import LocalPass, Table, add_part
from pdrom.model.dynamics.solvers import Factor
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import PHASES, FrameReport, State, Stepper
from pdrom.model.dynamics.system import Elimination, GlobalSystem
from pdrom.model.effects.forces import Gravity
from pdrom.model.scene import Scene

# Arguments of `add_projections`, and of `multiply`.
Tables = tuple[Table, ...]
Matrix = tuple[np.ndarray, np.ndarray, np.ndarray]
METHODS = Registry(
    "method",
    {
        "projective": "study.experiments.alternatives.solvers.projective:SmallSteps",
        "anderson": "study.experiments.alternatives.solvers.projective:Accelerated",
        "chebyshev": "study.experiments.alternatives.solvers.projective:Chebyshev",
        "explicit": "study.experiments.alternatives.solvers.explicit:Explicit",
    },
)


class Substeps(NamedTuple):
    """Some substeps of a frame, in the order in which the compiled loops take them.

    y, v : positions and velocities as padded vectors, flat; changed in place
    acceleration : (3,) m/s^2
    time_step : of a substep, s
    substeps, iterations : how many, and in each of them
    fixed, targets : held vertices (n,) and where they are (n, 3) at the end, m
    """

    y: np.ndarray
    v: np.ndarray
    acceleration: np.ndarray
    time_step: float
    substeps: int
    iterations: int
    fixed: np.ndarray
    targets: np.ndarray


class Alternative(Stepper):
    """A frame of length h in ``substeps`` steps of ``iterations`` each.

    A handle moves at constant speed during a frame, whatever the number of substeps; contacts act
    at its end, as in the step loop. What a group freezes at the beginning of a frame stays. Loops
    with equal substeps may share a ``system``.

    Raises
    ------
    SceneError
        A force that depends on the motion (it would have to be evaluated in every substep), or a
        group that the method does not take.
    """

    name: ClassVar[str]
    space: VertexSpace

    def __init__(
        self, scene: Scene, substeps: int, iterations: int = 1, system: GlobalSystem | None = None
    ) -> None:
        named = f"scene '{scene.config.name}', effect '%s': method '{self.name}' "
        for force in scene.forces:
            if not isinstance(force, Gravity):
                raise SceneError(named % force.name + "takes no force but gravity")
        for group in scene.groups:
            if group.local_kernel is None:
                raise SceneError(named % group.name + "needs a compiled local step")
        step = scene.config.time_step / substeps
        system = system or GlobalSystem(scene.masses, step, scene.groups)
        super().__init__(scene.space(system), step, iterations, scene.groups, False)
        self.substeps = substeps
        self.masses = scene.masses
        self.potential = Potential(scene.groups, scene.mesh.vertices)
        self._prepare(scene)

    def _prepare(self, scene: Scene) -> None:
        """Make what the method keeps from frame to frame; nothing by default."""

    def step(
        self, state: State, frame: int, on_last_iterate: Callable[[np.ndarray], None] | None = None
    ) -> tuple[State, FrameReport]:
        """Do ``frame`` from ``state``; no objective, and no iterate for ``on_last_iterate``."""
        started = perf_counter()
        q = state.positions
        fixed, targets = self.space.fixed(frame, q)
        acceleration = np.ascontiguousarray(self.space.acceleration(q, state.velocities))
        for local in self.local_steps:
            local.begin_frame(q)
        positions, velocities = as_vertices(q), as_vertices(state.velocities)
        y, v = flat(positions), flat(velocities)
        # what stands still needs no new targets between the substeps
        parts = 1 if np.array_equal(q[fixed], targets) else self.substeps
        for part in range(1, parts + 1):
            now = targets + (1.0 - part / parts) * (q[fixed] - targets)
            self._advance(
                Substeps(
                    *(y, v, acceleration, self.time_step, self.substeps // parts),
                    *(self.iterations, fixed, now),
                )
            )
        # contacts set the velocity of what they move by the whole frame
        free = positions.copy()
        self.space.correct(positions, q, frame)
        moved = (positions != free).any(axis=1)
        if moved.any():
            whole = self.time_step * self.substeps
            velocities[moved] = (positions[moved] - q[moved]) / whole
        after = State(np.ascontiguousarray(positions), np.ascontiguousarray(velocities))
        seconds = np.zeros(len(PHASES))
        seconds[1] = perf_counter() - started
        return after, FrameReport(np.empty(0), seconds)

    @abstractmethod
    def _advance(self, part: Substeps) -> None:
        """Do substeps in place."""

    def _factor(self, part: Substeps) -> Factor:
        """Factor of the system matrix without the held vertices, as `sweep` takes it."""
        elimination = self.space.eliminate(part.fixed, part.targets)
        assert isinstance(elimination, Elimination)
        assert elimination.factor is not None
        return elimination.factor


def inverse_masses(masses: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """1 / M of ``masses`` (N,) kg, zero for held vertices ``fixed`` (n,): nothing moves them."""
    inverse = 1.0 / masses
    inverse[fixed] = 0.0
    return inverse


@compiled(nogil=True)
def begin(y, v, acceleration, step, fixed, targets, before, s):
    """A substep of an implicit method begins at its prediction s = y + step v + step^2 a.

    ``before`` receives the positions; held vertices of ``s`` and ``y`` go to their targets.

    Parameters
    ----------
    y, v : padded positions m and velocities m/s, flat
    acceleration : (3,) m/s^2
    step : s
    fixed, targets : held vertices (n,) and where they are at the end (n, 3) m
    """
    for i in range(len(y) // WIDTH):
        for axis in range(3):
            k = WIDTH * i + axis
            before[k] = y[k]
            s[k] = y[k] + step * v[k] + step**2 * acceleration[axis]
        s[WIDTH * i + 3] = 0.0
    for j in range(len(fixed)):
        for axis in range(3):
            s[WIDTH * fixed[j] + axis] = targets[j, axis]
    y[:] = s


@compiled(nogil=True)
def end(y, before, step, v):
    """Velocities ``v`` from the positions ``y`` and ``before`` at both ends of a ``step``, s."""
    for k in range(len(y)):
        v[k] = (y[k] - before[k]) / step


class Potential:
    """Compiled local steps of groups, and the matrix S^T W S of all of them.

    Attributes
    ----------
    tables : first argument of `add_projections`
    stiffness : S^T W S, first argument of `multiply`
    """

    def __init__(self, groups: Sequence[ConstraintGroup], vertices: int) -> None:
        kernels = [group.local_kernel for group in groups if group.local_kernel is not None]
        self._pass = LocalPass(kernels)  # keeps the arrays that the tables point to
        local = self._pass
        self.tables: Tables = local.first, local.preparing, local.second
        total = sparse.csr_array((vertices, vertices))
        for group in groups:
            total = total + group.system_matrix()
        self.stiffness = rows_of(total)


def rows_of(matrix: sparse.csr_array) -> Matrix:
    """A matrix (N, N) as `multiply` takes it."""
    ordered = sparse.csr_array(matrix)
    ordered.sort_indices()
    return ordered.indptr.astype(np.int32), ordered.indices.astype(np.int32), ordered.data


@compiled(nogil=True)
def add_projections(tables, y, rhs):
    """Add S^T W p(y) of all groups in ``tables`` to ``rhs``, both padded, flat; the energy W(y)."""
    kernels, preparing, second = tables
    y_place, rhs_place = y.ctypes.data, rhs.ctypes.data
    add_part(preparing, y_place, rhs_place)
    energy = add_part(kernels, y_place, rhs_place)
    return energy + add_part(second, y_place, rhs_place)


@compiled(nogil=True)
def multiply(matrix, y, out):
    """Overwrite ``out`` by the matrix times ``y``, both padded vectors, flat."""
    indptr, indices, data = matrix
    for i in range(len(indptr) - 1):
        total = constant(0.0)
        for k in range(at(indptr, i), at(indptr, i + 1)):
            total = add_scaled(total, at(data, k), load(y, WIDTH * at(indices, k)))
        store(out, WIDTH * i, total)


def alternative(
    name: str, scene: Scene, substeps: int, iterations: int = 1, system: GlobalSystem | None = None
) -> Alternative:
    """Step loop of a scene by the method ``name``: so many ``substeps`` a frame, see `Alternative`.

    Each of them does ``iterations``; ``system`` is a factored one of equal substeps, to be shared.

    Raises
    ------
    ConfigurationError, SceneError
        Unknown name, a group or a force that the method does not take.
    """
    made: Alternative = METHODS.load(name)(scene, substeps, iterations, system)
    return made
