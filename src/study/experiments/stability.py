"""Run one scene for a short time with several time steps and stiffnesses, with every method."""

import logging
from collections.abc import Iterator
from typing import Annotated

import pandas as pd
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.energy import largest
from pdrom.model.runs import BLOWUP_EXTENT
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.rerun import Rerun, rerun
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting
from study.experiments.kit import base as kit
from study.experiments.kit.models import Methods, Model, stored_models
from study.experiments.kit.runs import Row, run

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "method", "r", "h", "stiffness_ratio", "finite", "blowup_frame", "max_extent",
    "energy_ratio", "gain", "group", "position_basis", "k", "frames", "relative_error",
]  # fmt: skip
FEWEST, MOST = 30, 120  # limits of the number of frames of a short run


class ShortRuns(ConfigModel):
    """Settings of short runs with other time steps and other stiffnesses of the reduced groups.

    Bases and samples are trained with the time step and stiffness of the scene, so that the runs
    show how far from these values a reduction can be used.

    ranks : basis sizes r of reductions; position subspaces are run at their largest size only
    time_steps : time steps in seconds, in addition to that of the scene
    stiffness_ratios : factors by which weights of reduced groups are multiplied, in addition to 1
    duration : simulated seconds; a run has `FEWEST` to `MOST` frames
    """

    ranks: tuple[kit.Rank, ...] = ()
    time_steps: tuple[Annotated[float, Field(gt=0.0, le=10.0)], ...] = ()
    stiffness_ratios: tuple[Annotated[float, Field(gt=0.0, le=1e8)], ...] = ()
    duration: Annotated[float, Field(gt=0.0)] = 1.0


class Stability(ShortRuns):
    """Section ``stability``: short runs, and limits above which a run is wrong or has diverged.

    scenes : names of the scenes; those that are not in the study are ignored
    wrong : a finite run counts as wrong if its relative error exceeds this value
    left : a run has left the scene if its bounding box exceeds this multiple of the largest
        bounding box of the full-order run
    """

    scenes: tuple[str, ...] = ()
    wrong: Annotated[float, Field(gt=0.0)] = 0.1
    left: Annotated[float, Field(gt=1.0)] = 2.0


@kit.experiment(
    "Runs of {scene} with other time steps and stiffnesses",
    reads={
        "mesh": paths.MESH,
        "bases": Every(paths.BASIS),
        "samplings": Every(paths.SAMPLING),
        "subspaces": Every(paths.SUBSPACES),
        "config": Setting("scene"),
        "methods": Setting("methods"),
        "short": Setting("stability"),
    },
    writes={"out": paths.STABILITY},
)
def stability(
    mesh: File, config: SceneConfig, methods: Methods, short: ShortRuns, out: File,
    **files: list[File],
) -> None:  # fmt: skip
    """Run full-order and reduced models with each time step, then with each stiffness."""
    scene = kit.scene_of(config, mesh)
    given = files["samplings"], files["bases"], methods, short.ranks, files["subspaces"]
    found = [({"position_basis": "full"} | own, model) for own, model in stored_models(*given)]
    most = max((labels["k"] for labels, _ in found if "k" in labels), default=None)
    models = [each for each in found if each[0].get("k", most) == most]
    # time step and stiffness are varied one at a time, never both
    h, ratios = scene.config.time_step, sorted({1.0, *short.stiffness_ratios} - {1.0})
    grid = [(step, 1.0) for step in sorted({h, *short.time_steps})] + [(h, own) for own in ratios]
    rows = []
    for step, ratio in grid:
        other = kit.varied(scene.config, step, ratio, short.duration, (FEWEST, MOST))
        own = {"scene": config.name, "h": step, "stiffness_ratio": ratio}
        rows += [own | row for row in _rows(Scene.build(other, scene.mesh), models)]
        log.info("h = %g s, stiffness times %g: %d frames", step, ratio, other.frames)
    table = pd.DataFrame(rows, columns=COLUMNS)
    whole = ["r", "blowup_frame", "k", "frames"]
    write_table(table.astype(dict.fromkeys(whole, "Int64")), out.path)


def _rows(scene: Scene, models: list[tuple[Row, Model | None]]) -> Iterator[Row]:
    """Yield rows of the full-order run of ``scene`` and, if it is finite, of all reduced runs."""
    loop, start = scene.stepper(track_objective=False), scene.initial_state()
    whole = rerun(scene, loop, start, None, BLOWUP_EXTENT)
    full = Yardstick(scene, whole.positions)

    def with_energy(row: Row, outcome: Rerun) -> Row:
        return row | {"energy_ratio": largest(full.scale.relative(outcome.positions))}

    row = {"method": "full", "position_basis": "full"} | full.row(whole)
    if not whole.finite:
        log.warning("the full-order run blew up, so that no reduced run is made")
        yield with_energy(row, whole)
        return
    yield with_energy(row | {"relative_error": 0.0}, whole)
    for labels, model in models:  # the model is None if the basis has too few modes
        yield with_energy(*run(full, model, labels)) if model else labels | {"frames": 0}
