"""Measure how much each simplification adds to the error of a reduced model (its error budget).

The simplifications are the subspace (span), its equations of motion (closure), the sampled elements
and the few iterations. They are added one by one in runs that are compared with converged runs.
"""

import logging
from collections.abc import Iterator

import numpy as np
import pandas as pd

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.runs import BLOWUP_EXTENT
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.rerun import rerun
from pdrom.reduction.subspace.model import ALL, SubspaceModel
from pdrom.reduction.subspace.space import projector
from pdrom.reduction.subspace.training import make_columns, sampled_models
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting
from study.experiments.kit import base as kit
from study.experiments.references import converged_positions

log = logging.getLogger(__name__)
Part = tuple[str, np.ndarray]

PARTS = SPAN, CLOSURE, SAMPLING, RUN, FULL_ORDER = (
    "span", "closure", "sampling", "run", "full_order",
)  # fmt: skip
COLUMNS = [
    "scene", "motion", "k", "skinning", "elements_sampled", "frames", "part", "error",
    "deformation_error",
]  # fmt: skip


class Budget(ConfigModel):
    """Section ``error_budget``: one model of each scene, trained on its converged training run.

    modes, tolerance : number of POD modes, and tolerance of the sampled elements
    iterations : local/global iterations of a frame in part "run"
    skinning : scenes with a second model, which has as many skinning columns as POD modes
    """

    modes: kit.Modes = 40
    tolerance: kit.Tolerance = 1e-2
    iterations: kit.Count = 5
    skinning: tuple[SceneName, ...] = ()


@kit.experiment(
    "Error budget of {scene}",
    reads={
        "mesh": paths.MESH,
        "sensitivity": paths.SENSITIVITY,
        "full_order": Every(paths.FULL_ORDER),
        "converged": Every(paths.CONVERGED),
        "config": Setting("scene"),
        "asked": Setting("error_budget"),
        "horizon": Setting("horizon"),
    },
    writes={"out": paths.ERROR_BUDGET},
)
def error_budget(
    mesh: File, sensitivity: File, full_order: list[File], converged: list[File],
    config: SceneConfig, asked: Budget, horizon: kit.Horizon, out: File,
) -> None:  # fmt: skip
    """Run every test trajectory of a scene with each simplification, until its horizon.

    A trajectory that did not converge has no rows; without a converged training run, none has.
    """
    runs = {run["run"]: converged_positions(run) for run in converged}
    rows, training = [], runs.pop(kit.TRAIN)
    counts = (0, asked.modes) if config.name in asked.skinning else (0,)
    for skinning in counts:
        if training is None:
            break
        scene = kit.scene_of(config, mesh)
        columns = make_columns([scene], training[1:], asked.modes, skinning)
        frames = np.arange(config.frames)
        (model,) = sampled_models([scene], columns, frames, [asked.tolerance])
        labels = {"scene": config.name, "k": asked.modes, "skinning": skinning}
        for run in full_order:
            motion, end = run["run"], horizon.frames(sensitivity, run["run"])
            if (reference := runs.get(motion)) is None or not end:
                continue
            test = kit.scene_of(config, mesh, motion).changed(frames=end)
            yardstick = Yardstick(test, reference[: end + 1])
            used = model.elements_evaluated(test)
            row = labels | {"motion": motion, "elements_sampled": used, "frames": end}
            full = FULL_ORDER, kit.positions_of(run, end)
            for part, positions in (*_parts(model, yardstick, asked.iterations), full):
                errors = zip(COLUMNS[-2:], yardstick.errors(positions, end), strict=True)
                rows.append({**row, "part": part, **dict(errors)})
            log.info("%s, %d skinning columns: done", motion, skinning)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)


def _parts(model: SubspaceModel, yardstick: Yardstick, few: int) -> Iterator[Part]:
    """Yield the name of each part of the budget with its positions (F + 1, N, 3) m.

    The parts are the best approximation of the reference in the subspace, converged runs with all
    elements and with the sampled elements, and a run with ``few`` iterations.
    """
    scene, columns = yardstick.scene, model.columns
    yield SPAN, columns.B @ (projector(columns, scene.masses) @ yardstick.reference)
    yield CLOSURE, _run(SubspaceModel(columns), scene)
    yield SAMPLING, _run(model, scene)
    yield RUN, _run(model, scene, few)


def _run(model: SubspaceModel, scene: Scene, iterations: int | None = None) -> np.ndarray:
    """Return the positions of a run with local/global ``iterations``; None: until convergence."""
    asked = scene.iterated(iterations or ALL, scene.config.anderson_window)
    loop, start = model.loop(asked, newton=iterations is None)
    output = model.output(float)
    return rerun(scene, loop, start, None, BLOWUP_EXTENT, lambda z: output(z).copy()).positions
