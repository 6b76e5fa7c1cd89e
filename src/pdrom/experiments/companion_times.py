"""Milliseconds a frame of a scene's companion, beside the full-order run in the same job."""

from dataclasses import dataclass
from typing import Annotated

import pandas as pd

from pdrom.core.paths import COMPANION, COMPANION_TIMES, MESH, File
from pdrom.core.store import write_table
from pdrom.experiments.kit.declaration import Experiment, JobSettings
from pdrom.experiments.kit.measurement import Protocol, Variant, measure
from pdrom.experiments.kit.scenes import scene_of
from pdrom.model.scene import SceneConfig
from pdrom.reduction.subspace.store import load_models

COLUMNS = ["scene", "elements_sampled", "companion_ms", "full_ms"]


class Settings(JobSettings):
    """What the times depend on, beside the machine."""

    scene: SceneConfig
    timing: Protocol


@dataclass(frozen=True)
class Inputs:
    """Files read."""

    mesh: Annotated[File, MESH]
    model: Annotated[File, COMPANION]


@dataclass(frozen=True)
class Outputs:
    """Files written."""

    table: Annotated[File, COMPANION_TIMES]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Time both in turn."""
    scene, timing = scene_of(settings.scene, inputs.mesh), settings.timing
    ((_, model),) = load_models(inputs.model.path)
    frames = min(timing.frames, scene.config.frames)
    full = scene.stepper(track_objective=False)
    variants = [
        Variant({}, *model.loop(scene), frames),
        Variant({}, full, scene.initial_state(), frames),
    ]
    times = [measured.frame for measured in measure(variants, timing.warmup, timing.repeats)]
    row = [scene.config.name, model.elements_evaluated(scene), *times]
    write_table(pd.DataFrame([row], columns=COLUMNS), outputs.table.path)


EXPERIMENT = Experiment("companion_times", "Times of the companion of {scene}", run, alone=True)
