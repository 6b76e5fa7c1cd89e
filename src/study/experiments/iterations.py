"""Error of runs with K local/global iterations per frame, against the limit K -> infinity.

In the limit, every frame minimises its objective. The local/global iteration converges linearly,
and slowly on stiff meshes. It is a quasi-Newton step with the constant system matrix A as Hessian.
L-BFGS started from A (Liu, Bouaziz and Kavan 2017, section 4) reaches the same limit in far fewer
evaluations, and is used here.
"""

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field
from scipy import sparse

from pdrom.core.store import open_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import FrameReport, State, Stepper
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.subspace.model import load_models
from study.artifact import paths
from study.artifact.reads import Every, Setting
from study.experiments.kit import base as kit
from study.experiments.kit import runfiles
from study.experiments.kit.base import experiment

log = logging.getLogger(__name__)

MODELS = ["scene", "position_basis", "k", "method", "error_converged"]
COLUMNS = [
    "scene", "iterations", "window", "frames", "error_converged", "error_scene", "residual",
]  # fmt: skip


class IterationCounts(ConfigModel):
    """Numbers of local/global iterations per frame (``counts``) of full-order runs.

    Counts above 2 are also run with Anderson acceleration of window ``anderson_window``, unless 0.
    """

    counts: tuple[Annotated[int, Field(ge=1, le=10_000)], ...] = (1, 2, 5, 10, 20, 40)
    anderson_window: Annotated[int, Field(ge=0, le=50)] = 5


class IterationSweep(IterationCounts):
    """Section ``iterations`` of the configuration: iteration counts, limits of the converged run.

    In the converged run, a frame ends when one more iteration would move no vertex by more than
    ``tolerance`` times the mesh's longest side, or after ``limit`` evaluations of its objective.
    """

    tolerance: kit.Tolerance = 1e-8
    limit: Annotated[int, Field(ge=2)] = 4000


@experiment(
    "Accuracy of {scene} against the number of iterations",
    reads={
        "mesh": paths.MESH,
        "fom": paths.TRAIN,
        "sensitivity": paths.SENSITIVITY,
        "subspaces": Every(paths.SUBSPACES),
        "config": Setting("scene"),
        "sweep": Setting("iterations"),
        "horizon": Setting("horizon"),
        "solver": Setting("solver"),
    },
    writes={"out": paths.ITERATIONS, "models": paths.SUBSPACES_CONVERGED},
)
def iterations(
    subspaces: list[paths.File],
    config: SceneConfig,
    sweep: IterationSweep,
    horizon: kit.Horizon,
    solver: kit.Solver,
    **files: paths.File,
) -> None:
    """Run a scene with every number K of iterations, and once to convergence.

    Runs end before the first frame in which perturbed full-order runs differ too much. Each K is
    run without (``window`` 0) and, if above 2, with Anderson acceleration. A row has the errors for
    one K against the converged run, and against the run with the scene's K. The last row is the
    converged run itself (empty ``iterations``) with its largest residual: the change by one more
    iteration, divided by the longest side of the mesh. If one of its frames did not converge,
    errors against this run are empty.

    The table ``models`` has the errors of stored reduced runs in position subspaces (training
    motion, the scene's K) against the converged run.
    """
    scene = kit.scene_of(config, files["mesh"])
    system = scene.system_with(solver)
    name = scene.config.name
    frames = max(1, horizon.frames(files["sensitivity"]))
    own = kit.positions_of(files["fom"], frames)
    best = ConvergedStepper(scene, system, sweep.tolerance, limit=sweep.limit)
    limit = kit.followed(best, scene.initial_state(), frames)
    if not best.converged:
        log.warning("%s: no convergence in %d evaluations", name, sweep.limit)
    log.info("%s: %.0f evaluations a frame", name, np.mean(best.evaluations))
    rows: list[tuple[object, ...]] = []
    counts = sorted({*sweep.counts, scene.config.iterations})
    for count, window in accelerated(counts, sweep.anderson_window):
        reached = own
        if (count, window) != (scene.config.iterations, scene.config.anderson_window):
            loop = stepper_of(scene, system, count, window=window)
            reached = kit.followed(loop, scene.initial_state(), frames)
        converged = runfiles.run_error(reached, limit) if best.converged else None
        rows.append(
            (name, count, window, frames, converged, runfiles.run_error(reached, own), None)
        )
    residual = max(best.changes) / scene.mesh.extent
    converged = 0.0 if best.converged else None
    rows.append((name, None, None, frames, converged, runfiles.run_error(limit, own), residual))
    table = pd.DataFrame(rows, columns=COLUMNS).astype({"iterations": "Int64", "window": "Int64"})
    write_table(table, files["out"].path)
    inside = []
    for source in subspaces:
        with open_hdf5(source.path) as file:
            for labels, model in load_models(source.path):
                basis, k, method = (labels[name] for name in MODELS[1:4])
                run = file[f"models/{basis}_k{k:03d}_{method}/train/coordinates"][: len(limit)]
                error = None
                if best.converged and len(run) == len(limit):
                    error = runfiles.run_error(np.stack([model.positions(z) for z in run]), limit)
                inside.append((name, basis, k, method, error))
    write_table(pd.DataFrame(inside, columns=MODELS), files["models"].path)


def accelerated(counts: list[int], window: int) -> list[tuple[int, int]]:
    """Pairs (iterations, Anderson window): all ``counts`` with 0, those over 2 with ``window``."""
    plain = [(count, 0) for count in counts]
    return plain + [(count, window) for count in counts if window and count > 2]


def stepper_of(scene: Scene, system: GlobalSystem, iterations: int, window: int) -> Stepper:
    """Full-order step loop of ``scene`` with ``iterations`` and Anderson ``window`` (0: none)."""
    changes = {"iterations": iterations, "anderson_window": window}
    other = replace(scene, config=scene.config.model_copy(update=changes))
    return other.stepper(system, track_objective=False)


MEMORY = 8  # number of steps that L-BFGS stores
SUFFICIENT = 1e-4  # Armijo's constant: least ratio of the objective's decrease to -slope x step
SHORTEST = 1e-4  # least fraction of a step to try; then a local/global iteration replaces the step

Evaluate = Callable[[np.ndarray], tuple[float, np.ndarray]]


class Minimum(NamedTuple):
    """Result of `minimise`.

    y : (n, 3) last iterate, m
    change : largest change of a coordinate by one more local/global iteration, m
    evaluations : number of evaluations, each of one local and one global step
    """

    y: np.ndarray
    change: float
    evaluations: int


def minimise(
    evaluate: Evaluate, matrix: sparse.csr_array, y: np.ndarray, tolerance: float, limit: int
) -> Minimum:
    """Minimise the objective of a frame by L-BFGS in the metric of ``matrix``, with backtracking.

    evaluate : function of y; returns the objective, and the result G(y) of one local/global
        iteration from y. The gradient is A (y - G(y)); G(y) equals y at fixed vertices.
    matrix : A, (n, n) symmetric positive definite
    y : (n, 3) start, m
    tolerance : the minimisation ends when no entry of G(y) - y exceeds this, m
    limit : largest number of evaluations
    """
    pairs: list[_Pair] = []
    objective, target = evaluate(y)
    d, evaluations = target - y, 1
    while np.abs(d).max(initial=0.0) > tolerance and evaluations < limit:
        direction = _direction(d, pairs)
        slope = -float(np.vdot(matrix @ d, direction))
        if slope >= 0.0:
            pairs, direction = [], d
            slope = -float(np.vdot(matrix @ d, d))
        step, noise = 1.0, 8.0 * np.finfo(float).eps * abs(objective)
        while True:
            trial = y + step * direction
            value, target = evaluate(trial)
            evaluations += 1
            if value <= objective + SUFFICIENT * step * slope + noise:
                break
            step *= 0.5
            if step < SHORTEST:
                trial, pairs = y + d, []
                value, target = evaluate(trial)
                evaluations += 1
                break
        after = target - trial
        moved, change = trial - y, d - after
        both = matrix @ np.hstack([moved, change])
        a_moved, a_change = both[:, :3].copy(), both[:, 3:].copy()  # faster than strided views
        curvature = float(np.vdot(moved, a_change))
        if curvature > 0.0:
            pairs = [*pairs, _Pair(moved, change, a_moved, a_change, curvature)][-MEMORY:]
        y, d, objective = trial, after, value
    return Minimum(y, float(np.abs(d).max(initial=0.0)), evaluations)


class _Pair(NamedTuple):
    """L-BFGS step s; change c, by this step, of A^-1 times the gradient; A s; A c; s^T A c."""

    step: np.ndarray
    change: np.ndarray
    a_step: np.ndarray
    a_change: np.ndarray
    curvature: float


def _direction(d: np.ndarray, pairs: list[_Pair]) -> np.ndarray:
    """L-BFGS direction by the two-loop recursion (Nocedal 1980); ``d`` = -A^-1 times gradient."""
    q, alphas = d.copy(), []
    for pair in reversed(pairs):
        alpha = np.vdot(pair.a_step, q) / pair.curvature
        q -= alpha * pair.change
        alphas.append(alpha)
    for pair, alpha in zip(pairs, reversed(alphas), strict=True):
        q += (alpha - np.vdot(pair.a_change, q) / pair.curvature) * pair.step
    return q


class ConvergedStepper(Stepper):
    """Full-order step loop that minimises the objective of every frame up to a tolerance.

    ``changes`` and ``evaluations`` list these fields of `Minimum` for the frames computed so far.
    """

    def __init__(self, scene: Scene, system: GlobalSystem, tolerance: float, limit: int) -> None:
        super().__init__(scene.space(system), scene.config.time_step, limit, scene.groups)
        self.space: VertexSpace
        self._tolerance = tolerance * scene.mesh.extent
        self.changes: list[float] = []
        self.evaluations: list[int] = []

    @property
    def converged(self) -> bool:
        """Whether every frame computed so far reached the tolerance."""
        return all(change <= self._tolerance for change in self.changes)

    def step(
        self, state: State, frame: int, on_last_iterate: Callable[[np.ndarray], None] | None = None
    ) -> tuple[State, FrameReport]:
        """Compute ``frame`` from ``state``; ``on_last_iterate`` is ignored, the report is empty."""
        s, elimination, base = self._begin(state, frame)
        rhs = np.empty_like(s)

        def evaluate(y: np.ndarray) -> tuple[float, np.ndarray]:
            np.copyto(rhs, base)
            energy = sum(local.accumulate(y, rhs) for local in self.local_steps)
            target = y.copy()
            elimination.solve(rhs, target)
            return energy + self.space.inertia_energy(y - s), target

        end = minimise(
            evaluate, self.space.system.matrix, s, tolerance=self._tolerance, limit=self.iterations
        )
        self.changes.append(end.change)
        self.evaluations.append(end.evaluations)
        return self._finish(state, end.y, frame), FrameReport(np.empty(0), np.zeros(4))


def converged_run(scene: Scene, tolerance: float, limit: int) -> np.ndarray | None:
    """Positions (F + 1, N, 3) m of a run of ``scene`` in which every frame has converged.

    Initial positions come first. None if, after ``limit`` evaluations of a frame's objective, one
    more iteration would move a vertex by over ``tolerance`` times the mesh's longest side.
    """
    best = ConvergedStepper(scene, scene.system, tolerance, limit)
    positions = kit.followed(best, scene.initial_state(), scene.config.frames)
    return positions if best.converged else None
