"""Reduced runs repeated: from moved starts, and trained on other frames."""

import logging
from typing import Annotated

import pandas as pd
from pydantic import Field

from pdrom.core.names import SceneName
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import SceneConfig
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.snapshots import load_snapshots
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Settings
from study.experiments.kit.declaration import experiment
from study.experiments.kit.repetition import ReducedRuns, Repetitions, Varied
from study.experiments.kit.scenes import positions_of, scene_of
from study.experiments.kit.settings import BlowupExtent, Horizon, Modes

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "r", "varied", "seed", "gain", "finite", "error",
]  # fmt: skip
VARIED: tuple[Varied, ...] = ("start", "training")


class Cells(ConfigModel):
    """Runs that are repeated: every method at every size in every scene (all groups of it)."""

    scenes: Annotated[tuple[SceneName, ...], Field(min_length=1)]
    methods: Annotated[tuple[str, ...], Field(min_length=1)]
    sizes: Annotated[tuple[Modes, ...], Field(min_length=1)]
    varied: tuple[Varied, ...] = VARIED


class RepetitionSection(Repetitions):
    """Section ``repetitions``: how runs are repeated, and which."""

    cells: tuple[Cells, ...] = ()


class Repeated(ConfigModel):
    """A method of the job's scene and group, with what it depends on."""

    method: str
    spec: MethodSpec
    sizes: tuple[Modes, ...]
    varied: tuple[Varied, ...]


class Options(ConfigModel):
    """Settings of the repetitions in a scene."""

    scene: SceneConfig
    repetitions: Repetitions
    repeated: tuple[Repeated, ...]
    horizon: Horizon
    blowup_extent: BlowupExtent


@experiment(
    "Repeated runs of {scene}, {group} reduced",
    reads={
        "mesh": paths.MESH,
        "fom": paths.TRAIN,
        "snapshots": paths.SNAPSHOTS,
        "sensitivity": paths.SENSITIVITY,
        "settings": Settings(Options),
    },
    writes={"out": paths.REPETITIONS},
)
def repetitions(
    mesh: File, fom: File, snapshots: File, sensitivity: File, settings: Options, out: File
) -> None:
    """Repeat every listed run of the scene and group."""
    labels = out.labels
    runs = ReducedRuns(
        scene_of(settings.scene, mesh),
        labels["group"],
        load_snapshots(snapshots.path),
        reference=positions_of(fom),
        end=settings.horizon.frames(sensitivity),
        blowup_extent=settings.blowup_extent,
    ).until_the_end()
    rows = []
    for own in settings.repeated:
        for varied in own.varied:
            found = runs.repeat(own.spec, own.sizes, varied, settings.repetitions)
            cell = {**labels, "method": own.method, "varied": varied}
            rows += [cell | vars(run) for run in sorted(found, key=lambda run: run.r)]
        log.info("%s", own.method)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)
