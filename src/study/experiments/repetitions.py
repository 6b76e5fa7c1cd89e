"""Reduced runs repeated: from moved starts, and trained on other frames."""

import logging
from collections.abc import Iterator
from itertools import groupby
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.names import SceneName
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import SceneConfig
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.snapshots import load_snapshots
from study.artifact.paths import (
    MESH,
    REPEATED_FRAMES,
    REPETITIONS,
    SENSITIVITY,
    SNAPSHOTS,
    TRAIN,
    File,
)
from study.artifact.reads import Settings
from study.experiments.kit.declaration import experiment
from study.experiments.kit.repetition import Repeater, Repetition, Repetitions, Varied
from study.experiments.kit.scenes import positions_of, scene_of
from study.experiments.kit.settings import BlowupExtent, Horizon, Modes

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "r", "varied", "seed", "gain", "finite", "error",
]  # fmt: skip
RANGES = ["error_low", "error_median", "error_high"]
FRAMES = ["scene", "group", "method", "r", "varied", "frame", *RANGES]
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
        "mesh": MESH,
        "fom": TRAIN,
        "snapshots": SNAPSHOTS,
        "sensitivity": SENSITIVITY,
        "settings": Settings(Options),
    },
    writes={"out": REPETITIONS, "by_frame": REPEATED_FRAMES},
)
def repetitions(
    mesh: File,
    fom: File,
    snapshots: File,
    sensitivity: File,
    settings: Options,
    out: File,
    by_frame: File,
) -> None:
    """Repeat every listed run of the scene and group."""
    labels = out.labels
    repeater = Repeater(
        scene_of(settings.scene, mesh),
        labels["group"],
        load_snapshots(snapshots.path),
        reference=positions_of(fom),
        end=settings.horizon.frames(sensitivity),
        asked=settings.repetitions,
        blowup_extent=settings.blowup_extent,
    )
    rows, frames = [], []
    for of_cell, runs in _cells(settings, repeater):
        cell = {**labels, **of_cell}
        rows += [cell | vars(run) for run in runs]
        frames.append(_ranges(runs).assign(**cell))
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)
    ranges = pd.concat(frames) if frames else pd.DataFrame()
    write_table(ranges.reindex(columns=FRAMES), by_frame.path)


def _cells(
    settings: Options, repeater: Repeater
) -> Iterator[tuple[dict[str, Any], list[Repetition]]]:
    """Labels of every repeated run, and its repetitions."""
    for method in settings.repeated:
        for varied in method.varied:
            runs = sorted(repeater.repeat(method.spec, method.sizes, varied), key=lambda run: run.r)
            for r, same in groupby(runs, key=lambda run: run.r):
                yield {"method": method.method, "r": r, "varied": varied}, list(same)
        log.info("%s", method.method)


def _ranges(runs: list[Repetition]) -> pd.DataFrame:
    """Least, median and largest error of each frame, from 1."""
    errors = np.stack([run.errors for run in runs])
    ranges = np.stack([errors.min(axis=0), np.median(errors, axis=0), errors.max(axis=0)], axis=1)
    made = pd.DataFrame(ranges, columns=RANGES)
    return made.assign(frame=np.arange(1, len(made) + 1))
