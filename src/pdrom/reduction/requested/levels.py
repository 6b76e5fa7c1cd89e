"""Levels of accuracy: the full order with few or many iterations, and reductions; and their runs.

What a frame costs is counted, not timed, so that a choice is the same in every run. The constants
are those of one thread of a processor of 2024; only their ratios matter.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from time import thread_time

import numpy as np

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.dynamics.whole_frames import BLOCK, WholeFrames
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.space import projector

WINDOW = 5  # differences of iterates that Anderson's acceleration combines
# Nanoseconds of the full order: a projection by its rows squared, an entry of the factor, a vertex
# in accelerated iterations; a frame in compiled code, and what Python adds to one that it does.
PROJECTION, ENTRY, ACCELERATED = 5.0, 0.9, 6.5
FRAME, IN_PYTHON = 2.3e4, 1.2e5
# The same of a reduction: a projection, a number of a dense product, the rest of an iteration.
SAMPLED, DENSE, ITERATION = 12.5, 0.23, 1.2e3
REDUCED_FRAME, REDUCED_IN_PYTHON = 4e4, 2.3e5
# Entries of the factor of a matrix with n entries and N rows: FILL n log2 N.
FILL = 0.35
# Shift of the second start in every coordinate, over the extent of the mesh.
MOVED, SEED = 1e-10, 0

FULL_ORDER = "full order"
OnWork = Callable[[str, float], None]
"""Told, while something is computed, its title and the counted work (ns) just done."""


def silent(title: str, work: float) -> None:
    """Report no progress of ``work``."""


@dataclass(frozen=True)
class Level:
    """A method for one frame.

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


class Trajectory:
    """A run of ``level`` on the motion of ``scene``, frame by frame.

    Only one run of a scene goes on at a time: its boundaries remember where they took hold.

    Parameters
    ----------
    moved : whether it starts a distance of round-off away from the scene's own start
    on_work : told of the frames that are done

    Attributes
    ----------
    defects : of checked frames, m, see `check`
    seconds : processor time of the frames, checks included
    """

    def __init__(
        self, level: Level, scene: Scene, moved: bool = False, on_work: OnWork = silent
    ) -> None:
        self.level, self._model, self._on_work = level, level.model, on_work
        hair = np.random.default_rng(SEED).standard_normal(scene.mesh.points.shape)
        state = scene.initial_state(MOVED * scene.mesh.extent * hair if moved else None)
        self._loop: Stepper
        if self._model is None:
            self._loop = level.scene(scene).stepper(scene.system, track_objective=False)
        else:
            self._loop = self._model.loop(level.scene(scene))[0]
            projection = projector(self._model.columns, scene.masses)
            state = State(projection @ state.positions, projection @ state.velocities)
        self._work = level.work(scene)
        self._state, self._ends = state, [state.positions]
        self.defects: dict[int, float] = {}
        self.seconds = 0.0

    @property
    def frames(self) -> int:
        """Frames that are done."""
        return len(self._ends) - 1

    @property
    def end(self) -> np.ndarray:
        """Positions (N, 3) m of all vertices at the end of the last frame."""
        return self._positions(self._ends[-1])

    @property
    def positions(self) -> np.ndarray:
        """Positions (F + 1, N, 3) m of all frames that are done, the initial ones first."""
        return np.stack([self._positions(y) for y in self._ends])

    def to(self, frame: int) -> "Trajectory":
        """Do all frames before number ``frame``."""
        for after in self._run(self._state, range(self.frames, frame)):
            self._state = after
            self._ends.append(after.positions)
            self._on_work(self.level.title, self._work)
        return self

    def _run(self, state: State, frames: range) -> Iterator[State]:
        with np.errstate(over="ignore", invalid="ignore"):
            started = thread_time()
            for after, _ in self._loop.run(state, frames):
                self.seconds += thread_time() - started
                yield after
                started = thread_time()

    def check(self, exact: "Trajectory") -> float:
        """Do the next frame, and do it by another run's loop ``exact``, too.

        Returns
        -------
        The defect: the distance, m, between both ends of the frame, which began at the same state.
        """
        frame, first = self.frames, self._state
        before = State(self._positions(first.positions), self._positions(first.velocities))
        self.to(frame + 1)
        (end,) = exact._run(before, range(frame, frame + 1))
        self._on_work(exact.level.title, exact._work)
        self.defects[frame] = float(np.linalg.norm(self.end - end.positions))
        return self.defects[frame]

    def differences(self, reference: np.ndarray) -> Iterator[np.ndarray]:
        """Differences (N, 3) m to the positions of a ``reference`` at the ends of its frames."""
        last = len(reference) - 1
        for frame in range(1, last + 1):
            if frame > self.frames:
                self.to(min(self.frames + BLOCK, last))
            yield self._positions(self._ends[frame]) - reference[frame]

    def _positions(self, y: np.ndarray) -> np.ndarray:
        return y if self._model is None else self._model.columns.B @ y
