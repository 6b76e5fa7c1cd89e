"""Two runs -> train, test and held-out snapshots of one group."""

from pdrom.model.scene import SceneConfig
from pdrom.reduction.snapshots import collect, save_snapshots, training_frames
from study.artifact.paths import HELDOUT, MESH, SNAPSHOTS, TRAIN, File
from study.artifact.reads import Setting
from study.experiments.kit.declaration import experiment
from study.experiments.kit.scenes import scene_of


@experiment(
    "Snapshots of {group} in {scene}",
    reads={"mesh": MESH, "train": TRAIN, "heldout": HELDOUT, "config": Setting("scene")},
    writes={"out": SNAPSHOTS},
)
def snapshots(mesh: File, train: File, heldout: File, config: SceneConfig, out: File) -> None:
    """Split the projections of a group that two runs stored and save them to ``out``."""
    group = out["group"]
    scene = scene_of(config, mesh)
    frames = training_frames(scene.config.frames, scene.config.reduce[group].train)
    found = collect(train.path, heldout.path, scene.group(group), scene.masses, frames)
    save_snapshots(found, out.path)
