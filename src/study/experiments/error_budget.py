"""Error budget of a reduced model: what its columns, closure, sampling and iterations add.

A model is run on test trajectories with one simplification after the other, and compared with the
converged runs.
"""

import logging
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pandas as pd

from pdrom.api import Model, Run, train
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.scene import SceneConfig
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.space import projector
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting
from study.experiments.kit import base as kit
from study.experiments.references import converged_positions

log = logging.getLogger(__name__)

PARTS = SPAN, CLOSURE, SAMPLING, RUN, FULL_ORDER = (
    "span", "closure", "sampling", "run", "full_order",
)  # fmt: skip
COLUMNS = [
    "scene", "motion", "k", "skinning", "elements_sampled", "frames", "part", "error",
    "deformation_error",
]  # fmt: skip


class Budget(ConfigModel):
    """Section ``error_budget``: one model of each scene, trained on its converged training run.

    modes, tolerance : numbers of POD modes, and tolerance of the sampled elements
    iterations : local/global iterations of a frame in part "run"
    skinning : scenes with a second model, which has as many skinning columns beside the modes
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

    Without a converged run there are no rows.
    """
    runs = {run["run"]: converged_positions(run) for run in converged}
    rows, training = [], runs.pop(kit.TRAIN)
    counts = (0, asked.modes) if config.name in asked.skinning else (0,)
    for skinning in counts:
        if training is None:
            break
        scene = kit.scene_of(config, mesh)
        own = Run(scene, training, np.zeros(config.frames))
        model = train(
            own, modes=asked.modes, tolerance=asked.tolerance, skinning=skinning, converged=False
        )
        labels = {"scene": config.name, "k": asked.modes, "skinning": skinning}
        for run in full_order:
            motion, end = run["run"], horizon.frames(sensitivity, run["run"])
            if (reference := runs.get(motion)) is None or not end:
                continue
            test = kit.scene_of(config, mesh, motion).changed(frames=end)
            yardstick = Yardstick(test, reference[: end + 1])
            used = model.reduced.elements_evaluated(test)
            row = labels | {"motion": motion, "elements_sampled": used, "frames": end}
            parts = [*_parts(model, yardstick, asked), (FULL_ORDER, kit.positions_of(run, end))]
            for part, positions in parts:
                errors = zip(COLUMNS[-2:], yardstick.errors(positions, end), strict=True)
                rows.append({**row, "part": part, **dict(errors)})
            log.info("%s, %d skinning columns: done", motion, skinning)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)


def _parts(model: Model, yardstick: Yardstick, asked: Budget) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name of a part of the budget, and the positions (F + 1, N, 3) m that it reaches.

    They are the best approximation of the reference in the subspace, runs whose frames converge,
    with all elements and with the sampled ones, and a run of a few iterations.
    """
    scene, reduced = yardstick.scene, model.reduced
    assert isinstance(reduced, SubspaceModel)
    columns = reduced.columns
    yield SPAN, columns.B @ (projector(columns, scene.masses) @ yardstick.reference)
    whole = replace(model, reduced=SubspaceModel(columns))
    yield CLOSURE, whole.run(scene, solver="newton").positions
    yield SAMPLING, model.run(scene, solver="newton").positions
    few = model.run(scene, iterations=asked.iterations, solver="local_global")
    yield RUN, few.positions
