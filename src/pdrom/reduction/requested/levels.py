"""Levels of accuracy (full-order or reduced solvers with K iterations), their runs and errors.

The reference run of a motion solves the implicit step by iterations with Anderson acceleration. It
has enough of them if a run with half as many differs from it by less than the tolerance. This
difference is used as the error of the reference run.

The cost of a frame is computed from operation counts, not timed, so that the choice of a level is
reproducible. Constants were measured on one thread of a 2024 processor; only their ratios matter.
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
# Full-order costs in ns. An iteration: PROJECTION p^2 per element of p rows, ENTRY per entry of the
# Cholesky factor, ACCELERATED per vertex (Anderson acceleration). A frame, besides its iterations:
# FRAME, and IN_PYTHON more unless one compiled call computes several frames.
PROJECTION, ENTRY, ACCELERATED = 5.0, 0.9, 6.5
FRAME, IN_PYTHON = 2.3e4, 1.2e5
# Costs of reduced models in ns. An iteration: ITERATION, SAMPLED p^2 per sampled element of p rows,
# DENSE per entry of dense matrices. A frame also: REDUCED_FRAME (+ REDUCED_IN_PYTHON if in Python).
SAMPLED, DENSE, ITERATION = 12.5, 0.23, 1.2e3
REDUCED_FRAME, REDUCED_IN_PYTHON = 4e4, 2.3e5
# The Cholesky factor of a matrix with n entries in N rows has about FILL n log2 N entries.
FILL = 0.35
# Size of the random shift of a perturbed start, relative to the mesh's longest side, and its seed.
MOVED, SEED = 1e-10, 0
CONVERGED, MOST = 80, 320  # iterations per frame of a reference run: at first, and at most
Quantity = Literal["position", "velocity"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)

OnFrame = Callable[[str], None]
"""Callback, called with the title of a level after each frame that the level has computed."""


def silent(title: str) -> None:
    """Do nothing: default of the callback that receives the ``title`` of a level of accuracy."""


@dataclass(frozen=True)
class Level:
    """A level of accuracy: a full-order or reduced solver with a number of iterations.

    iterations, window : iterations per frame; window of Anderson acceleration (0: none)
    model : position subspace with sampled elements; None for a full-order level
    tau : tolerance of the energy-conserving sampling (module `ecsw`) by which ``model`` was made
    """

    iterations: int
    window: int = 0
    model: SubspaceModel | None = None
    tau: float | None = None

    @property
    def title(self) -> str:
        """Name of this level of accuracy in messages and tables."""
        count = f"K = {self.iterations}"
        if self.model is None:
            return f"full order, {'Anderson, ' if self.window else ''}{count}"
        return f"ecsw, k = {self.model.columns.modes}, tau = {self.tau:g}, {count}"

    @property
    def exact(self) -> "Level":
        """More accurate full-order level, whose frames serve as reference to check this level."""
        return Level(CONVERGED if self.model is not None else 2 * self.iterations, WINDOW)

    def scene(self, scene: Scene) -> Scene:
        """Return ``scene`` with the number of iterations and the Anderson window of this level."""
        changes = {"iterations": self.iterations, "anderson_window": self.window}
        return replace(scene, config=scene.config.model_copy(update=changes))

    def work(self, scene: Scene) -> float:
        """Estimated time of a frame, ns; for a reduced model, contacts add `REDUCED_IN_PYTHON`."""
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
    """Run of ``scene`` by a ``level`` of accuracy, computed frame by frame.

    Only one run of a scene may be active, since its boundary conditions store positions of the run.

    Parameters
    ----------
    moved : whether to perturb the initial positions by `MOVED` times the mesh's longest side
    on_frame : called with the title of ``level`` after each frame

    Attributes
    ----------
    ends : positions (N, 3) m, initial ones and those at the end of every computed frame
    defects : number of a checked frame -> its defect, m: distance to a more accurate solution
    seconds : processor time of all computed frames, s
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
        """Positions (F + 1, N, 3) m of the initial state and all computed frames."""
        return np.stack(self.ends)

    def to(self, frame: int) -> "Trajectory":
        """Compute all frames before number ``frame`` (0-based); return this object."""
        for after in self._run(self._state, range(self.frames, frame)):
            self._state = after
            self.ends.append(self._of_vertices(after.positions))
        return self

    def check(self, exact: "Trajectory") -> float:
        """Compute the next frame twice from the same state, by this level and by that of ``exact``.

        Return the defect (error made in one frame): the distance, m, between the two results.
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
    """Return relative errors (F',) over the first 1, 2, ..., F' frames of a run.

    Errors are divided by the norm of the reference's displacement. Velocities are differences of
    frames. An error is infinite if the run is not finite, or differs from a reference at rest.
    ``differences`` (F', N, 3) m are positions of frames minus those of ``reference`` (F + 1, N, 3).
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
    """Largest n such that errors[n - 1], over the first n frames, is <= ``tolerance``; else 0."""
    within = np.flatnonzero(errors <= tolerance)
    return int(within[-1]) + 1 if len(within) else 0


class Motion:
    """Reference run of ``scene``, converged to the error ``tolerance``, and its accuracy.

    Parameters
    ----------
    quantity : quantity, position or velocity, whose errors are computed

    Attributes
    ----------
    reference : (F + 1, N, 3) m, positions
    iterations : number of iterations in each frame of the reference
    unconverged : relative errors (F,) of a run with half the iterations
    sensitivity : relative errors (F,) of a run with initial positions perturbed by `MOVED`
    unit : root mean square over frames of the displacement norm, m
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
        """Errors (F',) relative to `reference` over 1, ..., F' frames of a run (F' + 1, N, 3) m."""
        differences = positions[1:] - self.reference[1 : len(positions)]
        return relative_errors(differences, self.reference, self.quantity)
