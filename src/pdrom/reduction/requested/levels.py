"""Levels of accuracy (full-order and reduced solvers with K iterations), their runs and errors.

The reference of a motion solves the implicit step by accelerated iterations. Their number is large
enough if a run with half of them differs by less than the tolerance. The error of that run is used
as the error of the reference.

The cost of a frame is computed from operation counts, not timed, so that the choice of a level is
reproducible. The constants were measured on one thread of a 2024 processor; only ratios matter.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from time import thread_time
from typing import Literal, get_args

import numpy as np

from pdrom.model.dynamics.frames import WholeFrames
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.rerun import mean_motion
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.space import projector

WINDOW = 5  # number of differences of iterates that Anderson acceleration combines
# Full-order cost in ns: per projection and squared number of rows, per entry of the factor, per
# vertex of an accelerated iteration; per compiled frame, and extra per frame computed in Python.
PROJECTION, ENTRY, ACCELERATED = 5.0, 0.9, 6.5
FRAME, IN_PYTHON = 2.3e4, 1.2e5
# Reduced cost in ns: per projection, per entry of a dense product, other work of an iteration.
SAMPLED, DENSE, ITERATION = 12.5, 0.23, 1.2e3
REDUCED_FRAME, REDUCED_IN_PYTHON = 4e4, 2.3e5
# Estimated entries of the Cholesky factor of a matrix with n entries and N rows: FILL n log2 N.
FILL = 0.35
# Size of the random shift of a perturbed start, relative to the mesh extent, and its seed.
MOVED, SEED = 1e-10, 0
CONVERGED, MOST = 80, 320  # iterations of a reference: first number, doubled up to MOST
Quantity = Literal["position", "velocity"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)

OnFrame = Callable[[str], None]
"""Callback that gets the title of a level after each frame that the level has computed."""


def silent(title: str) -> None:
    """Report no progress of ``title``."""


@dataclass(frozen=True)
class Level:
    """A level of accuracy: a full-order or reduced solver with a number of iterations.

    iterations, window : iterations of a frame, and Anderson window (0: no acceleration)
    model : position subspace with sampled elements; None for a full-order level
    tau : tolerance of the sampling
    """

    iterations: int
    window: int = 0
    model: SubspaceModel | None = None
    tau: float | None = None

    @property
    def title(self) -> str:
        """Name of the level in messages and tables."""
        count = f"K = {self.iterations}"
        if self.model is None:
            return f"full order, {'Anderson, ' if self.window else ''}{count}"
        return f"ecsw, k = {self.model.columns.modes}, tau = {self.tau:g}, {count}"

    @property
    def exact(self) -> "Level":
        """More accurate full-order level by which frames of this level are checked."""
        return Level(CONVERGED if self.model is not None else 2 * self.iterations, WINDOW)

    def scene(self, scene: Scene) -> Scene:
        """Return ``scene`` with the iterations and Anderson window of the level."""
        changes = {"iterations": self.iterations, "anderson_window": self.window}
        return replace(scene, config=scene.config.model_copy(update=changes))

    def work(self, scene: Scene) -> float:
        """Estimated cost of a frame of ``scene``, ns; a reduction resolves contacts in Python."""
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
            count, rows = len(self.model.chosen(group).elements), group.rows_per_element
            iteration += count * rows * (SAMPLED * rows + DENSE * size)
        in_python = REDUCED_IN_PYTHON * (slow or len(scene.contacts) > 0)
        return REDUCED_FRAME + in_python + self.iterations * iteration


class Trajectory:
    """A run of ``level`` on the motion of ``scene``, frame by frame.

    Only one run of a scene may be active: its boundaries store positions when a hold begins.

    Parameters
    ----------
    moved : whether the start is perturbed by `MOVED` times the mesh extent
    on_frame : callback after each frame

    Attributes
    ----------
    ends : positions (N, 3) m at the start and at the end of every computed frame
    defects : frame -> defect of each checked frame, m, see `check`
    seconds : processor time of the frames, s
    """

    def __init__(
        self, level: Level, scene: Scene, moved: bool = False, on_frame: OnFrame = silent
    ) -> None:
        self.level, self._on_frame = level, on_frame
        hair = np.random.default_rng(SEED).standard_normal(scene.mesh.points.shape)
        state = scene.initial_state(MOVED * scene.mesh.extent * hair if moved else None)
        self._loop: Stepper
        if level.model is None:
            self._loop = level.scene(scene).stepper(scene.system, track_objective=False)
        else:
            self._loop = level.model.loop(level.scene(scene))[0]
            projection = projector(level.model.columns, scene.masses)
            state = State(projection @ state.positions, projection @ state.velocities)
        self._state, self.ends = state, [self._of_vertices(state.positions)]
        self.defects: dict[int, float] = {}
        self.seconds = 0.0

    @property
    def frames(self) -> int:
        """Number of frames computed so far."""
        return len(self.ends) - 1

    @property
    def positions(self) -> np.ndarray:
        """Positions (F + 1, N, 3) m of all computed frames, the initial ones first."""
        return np.stack(self.ends)

    def to(self, frame: int) -> "Trajectory":
        """Compute all frames before number ``frame`` and return the trajectory itself."""
        for after in self._run(self._state, range(self.frames, frame)):
            self._state = after
            self.ends.append(self._of_vertices(after.positions))
        return self

    def check(self, exact: "Trajectory") -> float:
        """Compute the next frame, and again from the same state by the loop of the run ``exact``.

        Returns
        -------
        The defect of the frame: the distance, m, between both results.
        """
        frame = self.frames
        before = State(self.ends[-1], self._of_vertices(self._state.velocities))
        self.to(frame + 1)
        (end,) = exact._run(before, range(frame, frame + 1))
        self.defects[frame] = float(np.linalg.norm(self.ends[-1] - end.positions))
        return self.defects[frame]

    def _run(self, state: State, frames: range) -> Iterator[State]:
        with np.errstate(over="ignore", invalid="ignore"):
            started = thread_time()
            for after, _ in self._loop.run(state, frames):
                self.seconds += thread_time() - started
                yield after
                self._on_frame(self.level.title)
                started = thread_time()

    def _of_vertices(self, y: np.ndarray) -> np.ndarray:
        return y if self.level.model is None else self.level.model.positions(y)


def relative_errors(
    differences: np.ndarray, reference: np.ndarray, quantity: Quantity
) -> np.ndarray:
    """Return errors (F',) over the first 1, 2, ... F' frames, relative to their motion.

    Velocities are finite differences of positions between frames. An error is infinite where the
    run is not finite, or where the reference does not move but the run differs from it.

    Parameters
    ----------
    differences : (F', N, 3) m, positions minus the ``reference`` (F + 1, N, 3) m, without its start
    """
    moved = reference[1 : len(differences) + 1] - reference[0]
    with np.errstate(over="ignore", invalid="ignore"):
        if quantity == "velocity":
            zero = np.zeros_like(reference[:1])
            moved, differences = (np.diff(q, axis=0, prepend=zero) for q in (moved, differences))
        errors = np.cumsum(np.sum(differences**2, axis=(1, 2)))
        sizes = np.cumsum(np.sum(moved**2, axis=(1, 2)))
        relative = np.sqrt(errors / np.where(sizes > 0.0, sizes, np.nan))
    relative[(sizes == 0.0) & (errors == 0.0)] = 0.0
    return np.nan_to_num(relative, nan=np.inf, posinf=np.inf)


def last_within(errors: np.ndarray, tolerance: float) -> int:
    """Largest n for which the error of the first n frames, errors[n - 1], is within tolerance."""
    within = np.flatnonzero(errors <= tolerance)
    return int(within[-1]) + 1 if len(within) else 0


class Motion:
    """Reference run of ``scene``, solved to an error of ``tolerance``, and its accuracy.

    Parameters
    ----------
    quantity : quantity, position or velocity, whose errors are computed

    Attributes
    ----------
    reference : (F + 1, N, 3) m, positions
    iterations : number of iterations in each frame of the reference
    unconverged : errors (F,) of a run with half the iterations
    sensitivity : relative differences (F,) of a run whose start is perturbed, see `MOVED`
    unit : root mean square displacement of a frame, m
    """

    def __init__(
        self, scene: Scene, tolerance: float, quantity: Quantity, on_frame: OnFrame = silent
    ) -> None:
        self.scene, self.quantity = scene, quantity
        count = CONVERGED

        def run(iterations: int, moved: bool = False) -> np.ndarray:
            level = Level(iterations, WINDOW)
            return Trajectory(level, scene, moved, on_frame).to(scene.config.frames).positions

        half, self.reference = run(count // 2), run(count)
        apart = run(count // 2, moved=True)[1:] - half[1:]
        self.sensitivity = relative_errors(apart, half, self.quantity)
        known = last_within(self.sensitivity, tolerance)
        self.unconverged = self.errors(half)
        while last_within(self.unconverged, tolerance) < known and count < MOST:
            count, half = 2 * count, self.reference
            self.reference = run(count)
            self.unconverged = self.errors(half)
        self.iterations = count
        self.unit = mean_motion(self.reference)

    def errors(self, positions: np.ndarray) -> np.ndarray:
        """Errors (F',) of a run with ``positions`` (F' + 1, N, 3) m, see `relative_errors`."""
        differences = positions[1:] - self.reference[1 : len(positions)]
        return relative_errors(differences, self.reference, self.quantity)
