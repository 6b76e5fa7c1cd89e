"""Solve scenes by alternatives to projective dynamics that minimise the same energies.

They are Chebyshev's semi-iteration (Wang 2015, alg. 1) and Anderson acceleration with a coarse
level. Each runs K local/global iterations of a frame in a compiled loop. Vertices are held, and
contacts act at the end of a frame, as in the ordinary step loop.
"""

from abc import abstractmethod
from collections.abc import Callable
from itertools import pairwise
from time import perf_counter
from typing import Any, ClassVar, NamedTuple

import numpy as np
from scipy import linalg

from pdrom.core.errors import SceneError
from pdrom.model.compiled.arithmetic import add, add_scaled, constant
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import WIDTH, as_vertices, at, flat, load, store, unflat, write
from pdrom.model.constraints.local_kernel import add_all, table_of
from pdrom.model.dynamics.acceleration import Anderson, combine, forget, refuse
from pdrom.model.dynamics.frames import inertia_energy, weighted
from pdrom.model.dynamics.solvers import Factor
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import PHASES, FrameReport, State, Stepper
from pdrom.model.dynamics.sweeps import sweep
from pdrom.model.dynamics.system import Elimination
from pdrom.model.effects.forces import Gravity
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.ecsw import Samples
from pdrom.reduction.subspace.model import SubspaceModel

WINDOW = 5  # number of earlier iterates in Anderson acceleration, as in Peng et al. 2018
# Parameters of Chebyshev's semi-iteration: convergence rate of the plain iteration, and largest
# number of plain iterations before the first extrapolation. Both are set by hand, as in Wang 2015.
# Of five rates that were tried, this rate is best in both compared scenes with a sheet, so that the
# choice favours this method.
RATE = 0.98
PLAIN = 5
POWER = 100  # number of plain iterations after which the rate is measured from two changes


class Frame(NamedTuple):
    """First arguments of a compiled loop over the iterations of a frame, in this order.

    y, v : (4 N,) positions m and velocities m/s, changed in place: x, y, z and 0 of each vertex
    acceleration : (3,) m/s^2
    time_step : s
    iterations : number of iterations
    fixed, targets : fixed vertices (n,) and their positions (n, 3) m at the end
    """

    y: np.ndarray
    v: np.ndarray
    acceleration: np.ndarray
    time_step: float
    iterations: int
    fixed: np.ndarray
    targets: np.ndarray


class Alternative(Stepper):
    """Base class of methods with ``iterations`` local/global iterations of a frame.

    Raises SceneError if the scene has a force other than gravity, or a group without a compiled
    local step.
    """

    name: ClassVar[str]
    space: VertexSpace

    def __init__(self, scene: Scene, iterations: int) -> None:
        named = f"scene '{scene.config.name}', effect '%s': method '{self.name}' "
        for force in scene.forces:
            if not isinstance(force, Gravity):
                raise SceneError(named % force.name + "supports no force other than gravity")
        step = scene.config.time_step
        super().__init__(scene.space(scene.system), step, iterations, scene.groups, False)
        kernels: list[Any] = [getattr(step, "local_kernel", None) for step in self.local_steps]
        for group, kernel in zip(scene.groups, kernels, strict=True):
            if kernel is None:
                raise SceneError(named % group.name + "needs a compiled local step")
        self.table = table_of(kernels)  # the local steps keep references to the kernels

    def step(
        self, state: State, frame: int, on_last_iterate: Callable[[np.ndarray], None] | None = None
    ) -> tuple[State, FrameReport]:
        """Compute ``frame`` from ``state``; ``on_last_iterate`` is ignored.

        The report counts the time of the whole frame as local step, and has no objective.
        """
        started = perf_counter()
        q = state.positions
        fixed, targets, anchors = self.space.fixed(frame, q, state.anchors)
        acceleration = np.ascontiguousarray(self.space.acceleration(q, state.velocities))
        for local in self.local_steps:
            local.begin_frame(q)
        positions, velocities = as_vertices(q), as_vertices(state.velocities)
        numbers = self.time_step, self.iterations, fixed, targets
        self._advance(Frame(flat(positions), flat(velocities), acceleration, *numbers))
        # a vertex that a contact moves gets its mean velocity over the frame
        free = positions.copy()
        self.space.correct(positions, q, frame)
        moved = (positions != free).any(axis=1)
        if moved.any():
            velocities[moved] = (positions[moved] - q[moved]) / self.time_step
        after = State(np.ascontiguousarray(positions), np.ascontiguousarray(velocities), anchors)
        seconds = np.zeros(len(PHASES))
        seconds[1] = perf_counter() - started
        return after, FrameReport(np.empty(0), seconds)

    @abstractmethod
    def _advance(self, part: Frame) -> None:
        """Advance positions and velocities in place."""

    def _factor(self, part: Frame) -> Factor:
        """Return the Cholesky factor of the system matrix without rows of fixed vertices."""
        elimination = self.space.eliminate(part.fixed, part.targets)
        assert isinstance(elimination, Elimination)
        assert elimination.factor is not None
        return elimination.factor


@inner
def begin(y, v, acceleration, step, fixed, targets, before, s):
    """Begin a frame at the prediction s = y + step v + step^2 a.

    ``before`` receives the old positions. In ``s`` and ``y``, fixed vertices are at their targets.

    y, v : (4 N,) positions m and velocities m/s: x, y, z and 0 of each vertex
    acceleration : (3,) m/s^2
    step : time step, s
    fixed, targets : fixed vertices (n,) and their positions (n, 3) m at the end of the frame
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
    write(s, y)


@inner
def end(y, before, step, v):
    """Set velocities ``v`` to (``y`` - ``before``) / ``step``; ``step`` is the duration in s."""
    for k in range(len(y)):
        v[k] = (y[k] - before[k]) / step


def measured_rate(scene: Scene) -> float:
    """Measure the rate of convergence of the plain iteration, by power iteration in frame 0."""
    loop, start = scene.iterated(POWER).stepper(track_objective=False), scene.initial_state()
    ends = []
    for count in range(POWER, POWER + 3):
        loop.iterations = count
        ends.append(loop.step(start, 0)[0].positions)
    last, change = (float(np.linalg.norm(b - a)) for a, b in pairwise(ends))
    return min(change / last, 1.0) if last > 0.0 else 0.0


class Chebyshev(Alternative):
    """Chebyshev's semi-iteration, which extrapolates each iterate from the last two iterates.

    The first extrapolation follows `PLAIN` plain iterations, or a third of all if that is less.
    """

    name = "chebyshev"
    rate = RATE

    def _advance(self, part: Frame) -> None:
        plain, inertia = min(PLAIN, self.iterations // 3), self.space.system.inertia
        _chebyshev(*part, inertia, self.table, self._factor(part), self.rate, plain)


@compiled(nogil=True)
def _chebyshev(
    y, v, acceleration, step, iterations, fixed, targets, inertia, table, factor, rate, plain
):
    panels, vertices, loads, work = factor
    before, s, rhs = np.empty(len(y)), np.empty(len(y)), np.empty(len(y))
    last, image = np.empty(len(y)), np.empty(len(y))
    begin(y, v, acceleration, step, fixed, targets, before, s)
    base = weighted(inertia, s)
    weight = 1.0
    write(y, last)
    for k in range(iterations):
        write(base, rhs)
        add_all(table, y, rhs)
        write(y, image)
        sweep(panels, vertices, loads, work, rhs, image)
        if k == plain:
            weight = 2.0 / (2.0 - rate * rate)
        elif k > plain:
            weight = 4.0 / (4.0 - rate * rate * weight)
        for j in range(len(y)):
            held = y[j]
            y[j] = weight * (image[j] - last[j]) + last[j]
            last[j] = held
    end(y, before, step, v)


INNER = 10  # number of coarse-level iterations (Anderson acceleration) in each iteration


class TwoLevel(Alternative):
    """Anderson acceleration with a coarse level: the position subspace of a ``model`` of the scene.

    The plain iteration converges slowly for deformations that are stiff in the system matrix A and
    soft in the objective. Its result G(y) is therefore corrected in the span of the columns V of
    the subspace, scaled to V^T A V = 1. The component V g, g = V^T A (G(y) - y), of the step from y
    to G(y) is replaced by V z, where z minimises the objective of y + V z, with sampled elements
    in place of all. This is the full approximation scheme (Brandt 1977) with one additive
    smoothing step: -g is the exact gradient in the span, so that z = g = 0 where y minimises the
    frame's objective, whatever elements are sampled. The corrected iteration is accelerated. An
    iterate that raises the objective is replaced by the last G(y) without correction.

    Raises SceneError if the scene has several groups, or if `Alternative` refuses it.
    """

    name = "two-level"

    def __init__(self, scene: Scene, iterations: int, model: SubspaceModel) -> None:
        super().__init__(scene, iterations)
        if len(scene.groups) != 1:
            raise SceneError(f"scene '{scene.config.name}': '{self.name}' supports only one group")
        columns, group = model.columns, scene.groups[0]
        system = self.space.system
        # leave out columns that move vertices fixed in any frame: y is not corrected there
        free = columns.B[:, columns.free]
        image = system.matrix @ free
        factor = linalg.cholesky(free.T @ image, lower=True)
        span, image = (linalg.solve_triangular(factor, a.T, lower=True) for a in (free, image))
        chosen = model.samples[group.name]
        assert isinstance(chosen, Samples)
        self._group, self._vertices = group.restricted(chosen.elements, chosen.factors)
        rows = span[:, self._vertices].T
        inertia = (span * (scene.masses / self.time_step**2)) @ span.T
        inverse = linalg.inv(inertia + rows.T @ (self._group.system_matrix() @ rows))
        assert self._group.local_kernel is not None
        self._sampled = table_of([self._group.local_kernel])
        self._matrices = tuple(
            np.ascontiguousarray(m) for m in (span.T, image, rows, inverse @ rows.T, inverse)
        )
        self._history, self._inner = Anderson(WINDOW), Anderson(WINDOW)
        self._inner.begin_frame(np.zeros((len(span), WIDTH)))

    def _advance(self, part: Frame) -> None:
        y = unflat(part.y)
        self._history.begin_frame(part.y.reshape(-1, WIDTH))
        self._group.begin_frame(y[self._vertices])
        coarse = (*self._matrices, self._vertices, self._sampled, self._inner.history)
        inertia = self.space.system.inertia
        _two_level(*part, inertia, self.table, self._factor(part), self._history.history, coarse)


@compiled(nogil=True)
def _two_level(
    y, v, acceleration, step, iterations, fixed, targets, inertia, table, factor, history, coarse
):
    panels, vertices, loads, work = factor
    before, s, rhs = np.empty(len(y)), np.empty(len(y)), np.empty(len(y))
    plain = np.empty(len(y))
    begin(y, v, acceleration, step, fixed, targets, before, s)
    base = weighted(inertia, s)
    forget(history)
    for k in range(iterations):
        write(base, rhs)
        objective = add_all(table, y, rhs) + inertia_energy(y, s, inertia)
        # 0: also test the iterate after the first correction, which may raise the objective
        if refuse(history, y, objective, 0):
            write(plain, y)
            continue
        sweep(panels, vertices, loads, work, rhs, y)
        if k < iterations - 1:
            write(y, plain)
            _correct(coarse, history[0], y)
            combine(history, y)
    end(y, before, step, v)


@inner
def _correct(coarse, start, image):
    """Correct ``image`` = G(y) on the ``coarse`` level, as in `TwoLevel`; ``start`` is y."""
    span, duals, rows, steps, inverse, vertices, table, history = coarse
    size, sampled = WIDTH * span.shape[1], WIDTH * len(vertices)
    step, x, at_start = np.zeros(size), np.empty(sampled), np.zeros(sampled)
    _add_product(duals, image - start, step)
    for i in range(len(vertices)):
        store(x, WIDTH * i, load(start, WIDTH * vertices[i]))
    add_all(table, x, at_start)
    first, z, moved, forces = np.zeros(size), np.empty(size), np.empty(sampled), np.empty(sampled)
    _add_product(inverse, step, first)
    write(first, z)
    forget(history)
    for _ in range(INNER):
        refuse(history, z, np.nan)  # the objective is unknown; with nan, no iterate is refused
        for i in range(sampled):
            moved[i], forces[i] = x[i], 0.0
        _add_product(rows, z, moved)
        add_all(table, moved, forces)
        for i in range(sampled):
            forces[i] -= at_start[i]
        write(first, z)
        _add_product(steps, forces, z)
        combine(history, z)
    z -= step
    _add_product(span, z, image)


@inner
def _add_product(matrix, x, out):
    """Add ``matrix`` (m, n) times ``x`` (n, 4) to ``out`` (m, 4); both are flat arrays."""
    m, n = matrix.shape
    numbers = matrix.reshape(-1)
    for i in range(m):
        # two independent sums, which the processor can compute in parallel
        even, odd = load(out, WIDTH * i), constant(0.0)
        for k in range(0, n - 1, 2):
            even = add_scaled(even, at(numbers, n * i + k), load(x, WIDTH * k))
            odd = add_scaled(odd, at(numbers, n * i + k + 1), load(x, WIDTH * (k + 1)))
        if n % 2:
            even = add_scaled(even, at(numbers, n * i + n - 1), load(x, WIDTH * (n - 1)))
        store(out, WIDTH * i, add(even, odd))
