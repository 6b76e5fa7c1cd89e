"""Levels of accuracy (full-order or reduced solvers with K iterations), their runs and errors.

The reference run of a motion solves the implicit step by L-BFGS until one more iteration changes
hardly anything. A run with a ten times larger change and a perturbed start differs from it by an
estimate of what is not known of the motion.

The cost of a frame is computed from operation counts, not timed, so that the choice of a level is
reproducible. Constants were measured on one thread of a 2024 processor; only their ratios matter.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import thread_time
from typing import Literal, get_args

import numpy as np

from pdrom.model.dynamics.frames import WholeFrames
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.runs import ConvergedStepper
from pdrom.model.scene import Scene
from pdrom.reduction.rerun import mean_motion
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.space import projector

WINDOW = 5  # number of differences of iterates that Anderson acceleration combines
# Full-order costs in ns. An iteration: PROJECTION p^2 per element of p rows, ENTRY per entry of the
# Cholesky factor, ACCELERATED per vertex (Anderson acceleration). A frame, besides its iterations:
# FRAME, and IN_PYTHON more unless one compiled call computes several frames. An evaluation of
# L-BFGS, in Python: EVALUATED iterations and EVALUATION.
PROJECTION, ENTRY, ACCELERATED = 5.0, 0.9, 6.5
FRAME, IN_PYTHON = 2.3e4, 1.2e5
EVALUATED, EVALUATION = 2.5, 1.5e5
# Costs of reduced models in ns. An iteration: ITERATION, SAMPLED p^2 per sampled element of p rows,
# DENSE per entry of dense matrices. A frame also: REDUCED_FRAME (+ REDUCED_IN_PYTHON if in Python).
SAMPLED, DENSE, ITERATION = 12.5, 0.23, 1.2e3
REDUCED_FRAME, REDUCED_IN_PYTHON = 4e4, 2.3e5
# The Cholesky factor of a matrix with n entries in N rows has about FILL n log2 N entries.
FILL = 0.35
# Size of the random shift of a perturbed start, relative to the mesh's longest side, and its seed.
MOVED, SEED = 1e-10, 0
CONVERGED = 80  # accelerated iterations of frames that check reductions
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
    residual : of a full order that solves frames by L-BFGS, in at most ``iterations`` evaluations:
        largest change by one more iteration, relative to the mesh's longest side; else None
    model : position subspace with sampled elements; None for a full-order level
    tau : tolerance of the energy-conserving sampling (module `ecsw`) by which ``model`` was made
    """

    iterations: int
    window: int = 0
    residual: float | None = None
    model: SubspaceModel | None = None
    tau: float | None = None

    @property
    def title(self) -> str:
        """Name of this level of accuracy in messages and tables."""
        if self.residual is not None:
            return f"full order, L-BFGS to {self.residual:g}"
        count = f"K = {self.iterations}"
        if self.model is None:
            return f"full order, {'Anderson, ' if self.window else ''}{count}"
        return f"ecsw, k = {self.model.columns.modes}, tau = {self.tau:g}, {count}"

    @property
    def exact(self) -> "Level":
        """More accurate full-order level, whose frames serve as reference to check this level."""
        if self.residual is not None:
            return EXACT
        return Level(CONVERGED if self.model is not None else 2 * self.iterations, WINDOW)

    def work(self, scene: Scene, iterations: float) -> float:
        """Estimated time of a frame with ``iterations``, ns.

        For a reduced model, contacts add `REDUCED_IN_PYTHON`.
        """
        effects = scene.groups, scene.forces, scene.boundaries, scene.contacts
        slow = not WholeFrames.suits(*effects)
        if self.model is None:
            vertices = scene.mesh.vertices
            iteration = ENTRY * FILL * scene.system.matrix.nnz * np.log2(vertices)
            iteration += ACCELERATED * vertices * (self.window > 0)
            iteration += sum(PROJECTION * g.rows_per_element**2 * g.elements for g in scene.groups)
            if self.residual is not None:
                iteration = EVALUATED * iteration + EVALUATION
            return FRAME + IN_PYTHON * slow + iterations * iteration
        size, iteration = self.model.columns.B.shape[1], ITERATION
        for group in scene.groups:
            count, rows = len(self.model.chosen(group).elements), group.rows_per_element
            iteration += count * rows * (SAMPLED * rows + DENSE * size)
        in_python = REDUCED_IN_PYTHON * (slow or len(scene.contacts) > 0)
        return REDUCED_FRAME + in_python + iterations * iteration


LIMIT = 4000  # largest number of evaluations in a frame that L-BFGS solves
EXACT = Level(LIMIT, residual=1e-8)  # of reference runs
LESS_EXACT = Level(LIMIT, residual=1e-7)  # of runs that show how well a reference run is known


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
        own = scene.iterated(level.iterations, level.window)
        self._loop: Stepper
        if level.residual is not None:
            self._loop = ConvergedStepper(scene, scene.system, level.residual, level.iterations)
        elif level.model is None:
            self._loop = own.stepper(scene.system, track_objective=False)
        else:
            self._loop = level.model.loop(own)[0]
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
    def solved(self) -> int:
        """Number of first frames that L-BFGS has solved; all computed ones with other solvers."""
        return int(getattr(self._loop, "solved", self.frames))

    @property
    def iterations(self) -> float:
        """Number of iterations of a frame; with L-BFGS mean number of evaluations."""
        return float(np.mean(getattr(self._loop, "evaluations", self.level.iterations)))

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
    """Reference run of ``scene``, solved to convergence, and its accuracy.

    Parameters
    ----------
    quantity : quantity, position or velocity, whose errors are computed

    Attributes
    ----------
    run, reference : the run, with level `EXACT`; its positions (F + 1, N, 3) m
    unknown : relative errors (F,) of a run with `LESS_EXACT` and a perturbed start; inf from the
        first frame on that L-BFGS has not solved
    unit : root mean square over frames of the displacement norm, m, at least `MOVED` times the
        mesh's longest side
    """

    def __init__(self, scene: Scene, quantity: Quantity, on_frame: OnFrame = silent) -> None:
        self.scene, self.quantity = scene, quantity

        frames = scene.config.frames
        self.run = Trajectory(EXACT, scene, on_frame=on_frame).to(frames)
        self.reference = self.run.positions
        other = Trajectory(LESS_EXACT, scene, moved=True, on_frame=on_frame).to(frames)
        self.unknown = self.errors(other.positions)
        self.unknown[self.run.solved :] = np.inf
        self.unit = max(mean_motion(self.reference), MOVED * scene.mesh.extent)

    def errors(self, positions: np.ndarray) -> np.ndarray:
        """Errors (F',) relative to `reference` over 1, ..., F' frames of a run (F' + 1, N, 3) m."""
        differences = positions[1:] - self.reference[1 : len(positions)]
        return relative_errors(differences, self.reference, self.quantity)
