"""Error of runs with K local/global iterations per frame, against the limit K -> infinity."""

from typing import Annotated

import pandas as pd
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.runs import followed
from pdrom.model.scene import SceneConfig
from pdrom.reduction.deviations import Yardstick
from study.artifact import paths
from study.artifact.reads import Setting
from study.experiments.kit import base as kit
from study.experiments.kit.base import experiment
from study.experiments.references import converged_positions

COLUMNS = ["scene", "iterations", "window", "frames", "error_converged", "deformation_converged"]


class IterationCounts(ConfigModel):
    """Section ``iterations``: numbers of local/global iterations per frame of full-order runs.

    Numbers in ``counts`` above 2 are also run with Anderson acceleration of window
    ``anderson_window``, unless 0.
    """

    counts: tuple[Annotated[int, Field(ge=1, le=10_000)], ...] = (1, 2, 5, 10, 20, 40)
    anderson_window: Annotated[int, Field(ge=0, le=50)] = 5


@experiment(
    "Accuracy of {scene} against the number of iterations",
    reads={
        "mesh": paths.MESH,
        "fom": paths.TRAIN,
        "converged": paths.CONVERGED.where(run="train"),
        "sensitivity": paths.SENSITIVITY,
        "config": Setting("scene"),
        "asked": Setting("iterations"),
        "horizon": Setting("horizon"),
    },
    writes={"out": paths.ITERATIONS},
)
def iterations(
    config: SceneConfig,
    asked: IterationCounts,
    horizon: kit.Horizon,
    out: paths.File,
    **files: paths.File,
) -> None:
    """Run a scene with every number K of iterations, until its horizon.

    A row has the errors for one K against the converged run; they are empty without such a run.
    """
    scene = kit.scene_of(config, files["mesh"])
    frames = max(1, horizon.frames(files["sensitivity"]))
    limit = converged_positions(files["converged"], frames)
    rows: list[tuple[object, ...]] = []
    counts = sorted({*asked.counts, config.iterations})
    for count, window in accelerated(counts, asked.anderson_window):
        errors: tuple[float | None, ...] = (None, None)
        if limit is not None:
            if (count, window) == (config.iterations, config.anderson_window):
                reached = kit.positions_of(files["fom"], frames)
            else:
                loop = scene.iterated(count, window).stepper(scene.system, track_objective=False)
                reached = followed(loop, scene.initial_state(), frames)
            errors = Yardstick(scene, limit).errors(reached, frames)
        rows.append((config.name, count, window, frames, *errors))
    table = pd.DataFrame(rows, columns=COLUMNS).astype({"iterations": "Int64", "window": "Int64"})
    write_table(table, out.path)


def accelerated(counts: list[int], window: int) -> list[tuple[int, int]]:
    """Pairs (iterations, Anderson window): all ``counts`` with 0, those over 2 with ``window``."""
    plain = [(count, 0) for count in counts]
    return plain + [(count, window) for count in counts if window and count > 2]
