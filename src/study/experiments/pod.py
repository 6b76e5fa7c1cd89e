"""Two runs -> snapshots of a group -> basis."""

import logging

from pdrom.model.scene import SceneConfig
from pdrom.reduction.basis import basis_of, save_basis
from pdrom.reduction.method import BasisSpec
from pdrom.reduction.snapshots import collect, load_snapshots, save_snapshots, training_frames
from study.artifact.paths import BASIS, HELDOUT, MESH, SNAPSHOTS, TRAIN, File
from study.artifact.reads import Setting
from study.experiments.kit.declaration import experiment
from study.experiments.kit.scenes import scene_of

log = logging.getLogger(__name__)


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


@experiment(
    "POD of {group} in {scene} ({basis})",
    reads={"snapshots": SNAPSHOTS, "spec": Setting("basis")},
    writes={"out": BASIS},
)
def pod(snapshots: File, spec: BasisSpec, out: File) -> None:
    """Compute a basis ``spec`` of the training ``snapshots`` and save it to ``out``."""
    data = load_snapshots(snapshots.path)
    basis = basis_of(data, spec)
    log.info("numerical rank %d of %d snapshots", basis.rank, len(data.train))
    save_basis(basis, out.path)
