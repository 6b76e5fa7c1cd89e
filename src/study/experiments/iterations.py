"""Error of K iterations against the limit K -> infinity."""

import logging
from dataclasses import replace
from typing import Annotated

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import open_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.stepper import Stepper
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.subspace.model import load_models
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting
from study.experiments.kit.converged import ConvergedStepper
from study.experiments.kit.declaration import experiment
from study.experiments.kit.reruns import run_error
from study.experiments.kit.scenes import followed, positions_of, scene_of
from study.experiments.kit.settings import Horizon, Solver, Tolerance

log = logging.getLogger(__name__)

MODELS = ["scene", "position_basis", "k", "method", "error_converged"]
COLUMNS = [
    "scene", "iterations", "window", "frames", "error_converged", "error_scene", "residual",
]  # fmt: skip


class IterationCounts(ConfigModel):
    """Full-order runs with K in ``counts``.

    Every K runs with Anderson acceleration over ``anderson_window`` iterates, too (0: not).
    """

    counts: tuple[Annotated[int, Field(ge=1, le=10_000)], ...] = (1, 2, 5, 10, 20, 40)
    anderson_window: Annotated[int, Field(ge=0, le=50)] = 5


class IterationSweep(IterationCounts):
    """Section ``iterations``: the counts, against a run whose every frame is converged.

    A frame is converged when one more iteration moves no vertex by more than ``tolerance`` times
    the extent; ``limit`` bounds the evaluations it may take.
    """

    tolerance: Tolerance = 1e-8
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
    mesh: File,
    fom: File,
    sensitivity: File,
    subspaces: list[File],
    config: SceneConfig,
    sweep: IterationSweep,
    horizon: Horizon,
    solver: Solver,
    out: File,
    models: File,
) -> None:
    """Run a scene with every K up to its horizon, and once to convergence.

    Each K runs plainly (``window`` 0) and with Anderson acceleration. Each row has the error of a
    K against the converged run and against the scene's own run; the last row is the converged run
    itself (``iterations`` empty) with its largest residual: the change by one more iteration,
    relative to the extent. If a frame stays above the tolerance there is no converged reference,
    and the errors against it are empty. The runs in position subspaces, whose iterations and
    training frames are those of the scene, have their error against it, too.
    """
    scene = scene_of(config, mesh)
    system = scene.system_with(solver)
    name = scene.config.name
    frames = max(1, horizon.frames(sensitivity))
    own = positions_of(fom, frames)
    best = ConvergedStepper(scene, system, sweep.tolerance, limit=sweep.limit)
    limit = followed(best, scene.initial_state(), frames)
    if not best.converged:
        log.warning("%s: no convergence in %d evaluations", name, sweep.limit)
    log.info("%s: %.0f evaluations a frame", name, np.mean(best.evaluations))
    rows: list[tuple[object, ...]] = []
    counts = sorted({*sweep.counts, scene.config.iterations})
    for count, window in accelerated(counts, sweep.anderson_window):
        reached = own
        if (count, window) != (scene.config.iterations, scene.config.anderson_window):
            loop = stepper_of(scene, system, count, window=window)
            reached = followed(loop, scene.initial_state(), frames)
        converged = run_error(reached, limit) if best.converged else None
        rows.append((name, count, window, frames, converged, run_error(reached, own), None))
    residual = max(best.changes) / scene.mesh.extent
    converged = 0.0 if best.converged else None
    rows.append((name, None, None, frames, converged, run_error(limit, own), residual))
    table = pd.DataFrame(rows, columns=COLUMNS).astype({"iterations": "Int64", "window": "Int64"})
    write_table(table, out.path)
    inside = []
    for source in subspaces:
        with open_hdf5(source.path) as file:
            for labels, model in load_models(source.path):
                basis, k, method = (labels[name] for name in MODELS[1:4])
                run = file[f"models/{basis}_k{k:03d}_{method}/train/coordinates"][: len(limit)]
                error = None
                if best.converged and len(run) == len(limit):
                    error = run_error(np.stack([model.positions(z) for z in run]), limit)
                inside.append((name, basis, k, method, error))
    write_table(pd.DataFrame(inside, columns=MODELS), models.path)


def accelerated(counts: list[int], window: int) -> list[tuple[int, int]]:
    """(K, window) of all runs of ``counts`` K: plain ones, then those where two iterates mix."""
    plain = [(count, 0) for count in counts]
    return plain + [(count, window) for count in counts if window and count > 2]


def stepper_of(scene: Scene, system: GlobalSystem, iterations: int, window: int) -> Stepper:
    """Full-order step loop of ``scene``, with ``iterations`` and a ``window`` of acceleration."""
    changes = {"iterations": iterations, "anderson_window": window}
    other = replace(scene, config=scene.config.model_copy(update=changes))
    return other.stepper(system, track_objective=False)
