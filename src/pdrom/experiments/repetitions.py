"""Reduced runs repeated: from moved starts, and trained on other frames."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import pandas as pd
from pydantic import Field

from pdrom.core.names import SceneName
from pdrom.core.paths import MESH, REPETITIONS, SENSITIVITY, SNAPSHOTS, TRAIN, File
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.experiments.declaration import Experiment, JobSettings
from pdrom.experiments.repetition import Repeater, Repetitions, Varied
from pdrom.experiments.scenes import positions_of, scene_of
from pdrom.experiments.settings import BlowupExtent, Horizon, Modes
from pdrom.model.scene import SceneConfig
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.snapshots import load_snapshots

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


class Settings(JobSettings):
    """What the repetitions in a scene depend on."""

    scene: SceneConfig
    repetitions: Repetitions
    repeated: tuple[Repeated, ...]
    horizon: Horizon
    blowup_extent: BlowupExtent


@dataclass(frozen=True)
class Inputs:
    """Files read."""

    mesh: Annotated[File, MESH]
    fom: Annotated[File, TRAIN]
    snapshots: Annotated[File, SNAPSHOTS]
    sensitivity: Annotated[File, SENSITIVITY]


@dataclass(frozen=True)
class Outputs:
    """Files written: a row for every repetition."""

    table: Annotated[File, REPETITIONS]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Repeat every listed run of the scene and group."""
    labels = outputs.table.labels
    repeater = Repeater(
        scene_of(settings.scene, inputs.mesh),
        labels["group"],
        load_snapshots(inputs.snapshots.path),
        positions_of(inputs.fom),
        settings.horizon.frames(inputs.sensitivity),
        settings.repetitions,
        settings.blowup_extent,
    )
    rows = [{**labels, **row} for row in _rows(settings, repeater)]
    write_table(pd.DataFrame(rows, columns=COLUMNS), outputs.table.path)


def _rows(settings: Settings, repeater: Repeater) -> Iterator[dict[str, Any]]:
    for cell in settings.repeated:
        for varied in cell.varied:
            for run in repeater.repeat(cell.spec, cell.sizes, varied):
                yield {"method": cell.method, "varied": varied, **vars(run)}
        log.info("%s", cell.method)


EXPERIMENT = Experiment("repetitions", "Repeated runs of {scene}, {group} reduced", run)
