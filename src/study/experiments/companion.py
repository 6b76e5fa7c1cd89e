"""The auxiliary model of a scene's runs: a finer model, trained on the training motion."""

from typing import Annotated

from pydantic import Field

from pdrom.core.store import write_hdf5
from pdrom.model.scene import SceneConfig
from pdrom.reduction.subspace.companion import CompanionSpec, companion_model
from pdrom.reduction.subspace.store import store_columns, store_model
from study.artifact.paths import COMPANION, MESH, TRAIN, File
from study.artifact.reads import Setting
from study.experiments.kit.declaration import experiment
from study.experiments.kit.motion import Motion, training_indices, training_positions
from study.experiments.kit.scenes import scene_of


class Companion(CompanionSpec):
    """Section ``companion``: the auxiliary model, tolerances of users, and a safety factor on
    estimates.

    The factor was chosen when results were known: an estimate may be too small, since the auxiliary
    model has an error of its own.
    """

    tolerances: tuple[Annotated[float, Field(gt=0.0, allow_inf_nan=False)], ...] = (0.1, 0.03, 0.01)
    safety: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 1.3


@experiment(
    "Auxiliary model of the runs of {scene}",
    reads={
        "mesh": MESH,
        "train": TRAIN,
        "config": Setting("scene"),
        "spec": Setting("companion"),
    },
    writes={"out": COMPANION},
)
def companion(mesh: File, train: File, config: SceneConfig, spec: CompanionSpec, out: File) -> None:
    """Make the auxiliary model of a scene and store it in ``out``."""
    motion = Motion(scene_of(config, mesh), train)
    frames, training = training_indices(motion.scene), training_positions(motion)
    model = companion_model(motion.scene, training, frames, spec=spec)
    labels = {"method": "ecsw", "position_basis": model.position_basis, "base": "companion"}
    with write_hdf5(out.path) as file:
        store_columns(file.create_group("columns/companion"), model.columns)
        store = file.create_group("models/companion")
        store_model(store, {**labels, "k": spec.modes}, model.samples)
