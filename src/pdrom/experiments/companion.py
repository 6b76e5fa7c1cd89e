"""The companion of a scene's runs: a finer model, trained on the training motion."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from pdrom.core.paths import COMPANION, MESH, TRAIN, File
from pdrom.core.store import write_hdf5
from pdrom.experiments.kit.declaration import Experiment, JobSettings
from pdrom.experiments.kit.motion import Motion, training_indices, training_positions
from pdrom.experiments.kit.scenes import scene_of
from pdrom.model.scene import SceneConfig
from pdrom.reduction.subspace.companion import CompanionSpec, companion_model
from pdrom.reduction.subspace.store import store_columns, store_model


class Companion(CompanionSpec):
    """Section ``companion``: the companion, tolerances of users, and a safety factor on estimates.

    The factor was chosen when results were known: an estimate may be too small, since the companion
    has an error of its own.
    """

    tolerances: tuple[Annotated[float, Field(gt=0.0, allow_inf_nan=False)], ...] = (0.1, 0.03, 0.01)
    safety: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 1.3


class Settings(JobSettings):
    """What the companion of a scene depends on."""

    scene: SceneConfig
    companion: CompanionSpec


@dataclass(frozen=True)
class Inputs:
    """Files read."""

    mesh: Annotated[File, MESH]
    train: Annotated[File, TRAIN]


@dataclass(frozen=True)
class Outputs:
    """Files written."""

    model: Annotated[File, COMPANION]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Make the companion."""
    motion = Motion(scene_of(settings.scene, inputs.mesh), inputs.train)
    frames, training = training_indices(motion.scene), training_positions(motion)
    model = companion_model(motion.scene, training, frames, settings.companion)
    labels = {"method": "ecsw", "position_basis": model.position_basis, "base": "companion"}
    with write_hdf5(outputs.model.path) as file:
        store_columns(file.create_group("columns/companion"), model.columns)
        store = file.create_group("models/companion")
        store_model(store, {**labels, "k": settings.companion.modes}, model.samples)


EXPERIMENT = Experiment("companion", "Companion of the runs of {scene}", run)
