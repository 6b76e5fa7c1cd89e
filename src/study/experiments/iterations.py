"""Error of runs with K local/global iterations per frame, against the limit K -> infinity.

In the limit, every frame minimises its objective (`ConvergedStepper`).
"""

import logging
from typing import Annotated

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import open_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.runs import ConvergedStepper, followed
from pdrom.model.scene import SceneConfig
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
    },
    writes={"out": paths.ITERATIONS, "models": paths.SUBSPACES_CONVERGED},
)
def iterations(
    subspaces: list[paths.File],
    config: SceneConfig,
    sweep: IterationSweep,
    horizon: kit.Horizon,
    **files: paths.File,
) -> None:
    """Run a scene with every number K of iterations, and once to convergence.

    Runs end at the horizon. A row has the errors for one K against the converged run (empty if a
    frame of it did not converge), and against the run with the scene's K. The last row is the
    converged run itself (empty ``iterations``) with its largest residual: the change by one more
    iteration, divided by the longest side of the mesh. The table ``models`` has the errors of
    stored reduced runs of the training motion in position subspaces against the converged run.
    """
    scene = kit.scene_of(config, files["mesh"])
    system, name = scene.system, scene.config.name
    frames = max(1, horizon.frames(files["sensitivity"]))
    own = kit.positions_of(files["fom"], frames)
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
            loop = scene.iterated(count, window).stepper(system, track_objective=False)
            reached = followed(loop, scene.initial_state(), frames)
        converged = runfiles.run_error(reached, limit) if best.converged else None
        error = runfiles.run_error(reached, own)
        rows.append((name, count, window, frames, converged, error, None))
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
