"""Base class of methods that solve a frame in a compiled loop of their own.

Vertices are held, and contacts act at the end of a frame, as in the ordinary step loop.
"""

from abc import abstractmethod
from collections.abc import Callable
from time import perf_counter
from typing import Any, ClassVar, NamedTuple

import numpy as np

from pdrom.core.errors import SceneError
from pdrom.model.compiled.functions import inner
from pdrom.model.compiled.rows import WIDTH, as_vertices, flat, write
from pdrom.model.constraints.local_kernel import table_of
from pdrom.model.dynamics.solvers import Factor
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import PHASES, FrameReport, State, Stepper
from pdrom.model.dynamics.system import Elimination
from pdrom.model.effects.forces import Gravity
from pdrom.model.scene import Scene


class Frame(NamedTuple):
    """First arguments of a compiled loop over the iterations of a frame, in their order.

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
                raise SceneError(named % force.name + "takes no force but gravity")
        step = scene.config.time_step
        super().__init__(scene.space(scene.system), step, iterations, scene.groups, False)
        self.masses = scene.masses
        kernels: list[Any] = [getattr(step, "local_kernel", None) for step in self.local_steps]
        for group, kernel in zip(scene.groups, kernels, strict=True):
            if kernel is None:
                raise SceneError(named % group.name + "needs a compiled local step")
        self.table = table_of(kernels)  # the local steps keep the kernels
        self._prepare(scene)

    def _prepare(self, scene: Scene) -> None:
        """Prepare data that the method uses in all frames; the base class prepares nothing."""

    def step(
        self, state: State, frame: int, on_last_iterate: Callable[[np.ndarray], None] | None = None
    ) -> tuple[State, FrameReport]:
        """Compute ``frame`` from ``state``; ``on_last_iterate`` is ignored.

        The report has the time of the whole frame as that of the local step, and no objective.
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
        """Cholesky factor of the system matrix without the rows and columns of fixed vertices."""
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
