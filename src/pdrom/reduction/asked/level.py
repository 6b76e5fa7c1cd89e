"""Ways to do a frame, from cheap to costly: full order with few or many iterations, and reductions.

What a frame costs is counted, not timed, so that a choice is the same in every run. The constants
are those of one thread of a processor of 2024; only their ratios matter.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.dynamics.whole_frames import WholeFrames
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.space import projector

WINDOW = 5  # differences of iterates that Anderson's acceleration combines
# Nanoseconds of the full order: a projection by its rows squared, an entry of the factor, a vertex
# in accelerated iterations; a frame in compiled code, and what Python adds to one that it does.
PROJECTION, ENTRY, ACCELERATED = 5.0, 0.9, 6.5
FRAME, IN_PYTHON = 2.3e4, 1.2e5
# The same of a reduction: a projection, a number of a dense product, an iteration beside them.
SAMPLED, DENSE, ITERATION = 12.5, 0.23, 1.2e3
REDUCED_FRAME, REDUCED_IN_PYTHON = 4e4, 2.3e5
# Entries of the factor of a matrix with n entries and N rows: FILL n log2 N.
FILL = 0.35

FULL_ORDER = "full order"


@dataclass(frozen=True)
class Level:
    """A way to do a frame.

    iterations, window : of the step loop; a window of 0 accelerates nothing
    model : position subspace with sampled elements; None for the full order
    tau : tolerance of the sampling
    """

    iterations: int
    window: int = 0
    model: SubspaceModel | None = None
    tau: float | None = None

    @property
    def title(self) -> str:
        """Name for messages and tables."""
        count = f"K = {self.iterations}"
        if self.model is None:
            return f"{FULL_ORDER}, {'Anderson, ' if self.window else ''}{count}"
        return f"ecsw, k = {self.model.columns.modes}, tau = {self.tau:g}, {count}"

    def scene(self, scene: Scene) -> Scene:
        """The scene with the level's iterations."""
        changes = {"iterations": self.iterations, "anderson_window": self.window}
        return replace(scene, config=scene.config.model_copy(update=changes))

    def work(self, scene: Scene, touching: float = 0.0) -> float:
        """Estimated nanoseconds of a frame of ``scene``.

        ``touching`` is the share of frames with a contact, which a reduction resolves in Python.
        """
        effects = scene.groups, scene.forces, scene.boundaries, scene.contacts
        slow = not WholeFrames.suits(*effects)
        if self.model is None:
            vertices = scene.mesh.vertices
            iteration = ENTRY * FILL * scene.system.matrix.nnz * np.log2(vertices)
            iteration += ACCELERATED * vertices * (self.window > 0)
            iteration += sum(PROJECTION * g.rows_per_element**2 * g.elements for g in scene.groups)
            return FRAME + IN_PYTHON * slow + self.iterations * iteration
        size, iteration = self.model.columns.B.shape[1], ITERATION
        for group in scene.groups:
            count, rows = self.model.evaluated(group), group.rows_per_element
            iteration += count * rows * (SAMPLED * rows + DENSE * size)
        in_python = REDUCED_IN_PYTHON * max(touching, slow)
        return REDUCED_FRAME + in_python + self.iterations * iteration

    def on(self, scene: Scene) -> "Running":
        """The level on the motion of ``scene``."""
        return Running(self, scene)


class Running:
    """A level's step loop on a motion; states outside are those of all vertices.

    One factored ``system`` serves all levels on a motion, by default that of the ``scene``.
    """

    def __init__(self, level: Level, scene: Scene, system: GlobalSystem | None = None) -> None:
        self._model = level.model
        self._loop: Stepper
        if self._model is None:
            system = system or scene.system
            self._loop = level.scene(scene).stepper(system, track_objective=False)
        else:
            self._loop = self._model.loop(level.scene(scene))[0]
            self._project = projector(self._model.columns, scene.masses)

    def inside(self, state: State) -> State:
        """A state of the vertices in the coordinates of the loop."""
        if self._model is None:
            return state
        return State(self._project @ state.positions, self._project @ state.velocities)

    def outside(self, state: State) -> State:
        """A state of the loop at all vertices."""
        return State(self.positions(state.positions), self.positions(state.velocities))

    def positions(self, y: np.ndarray) -> np.ndarray:
        """Positions (N, 3) m of all vertices for coordinates ``y`` of the loop."""
        return y if self._model is None else self._model.columns.B @ y

    def run(self, state: State, frames: range) -> Iterator[State]:
        """States of the loop after each of ``frames``, from its ``state``."""
        with np.errstate(over="ignore", invalid="ignore"):
            for after, _ in self._loop.run(state, frames):
                yield after
