"""Two runs -> train, test and held-out snapshots of one group."""

from dataclasses import dataclass
from typing import Annotated

from pdrom.core.paths import HELDOUT, MESH, SNAPSHOTS, TRAIN, File
from pdrom.experiments.kit.declaration import Experiment, JobSettings
from pdrom.experiments.kit.scenes import scene_of
from pdrom.model.scene import SceneConfig
from pdrom.reduction.snapshots import collect, save_snapshots, training_frames


class Settings(JobSettings):
    """What the snapshots of a scene depend on."""

    scene: SceneConfig


@dataclass(frozen=True)
class Inputs:
    """Files read."""

    mesh: Annotated[File, MESH]
    train: Annotated[File, TRAIN]
    heldout: Annotated[File, HELDOUT]


@dataclass(frozen=True)
class Outputs:
    """Files written."""

    snapshots: Annotated[File, SNAPSHOTS]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Split the stored projections of a group and save them."""
    group = outputs.snapshots["group"]
    scene = scene_of(settings.scene, inputs.mesh)
    train = training_frames(scene.config.frames, scene.config.reduce[group].train)
    found = collect(inputs.train.path, inputs.heldout.path, scene.group(group), scene.masses, train)
    save_snapshots(found, outputs.snapshots.path)


EXPERIMENT = Experiment("snapshots", "Snapshots of {group} in {scene}", run)
