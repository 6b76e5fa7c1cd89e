"""Mesh of a scene, its full-order runs, and the snapshots and POD bases of its reduced groups."""

import logging
from pathlib import Path

from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.config import MeshConfig
from pdrom.model.mesh.types import save_mesh
from pdrom.model.runs import run
from pdrom.model.scene import SceneConfig
from pdrom.reduction import snapshots as sets
from pdrom.reduction.basis import basis_of, save_basis
from pdrom.reduction.method import BasisSpec
from study.artifact.paths import BASIS, HELDOUT, KICK, MESH, SNAPSHOTS, STIFFNESS, TRAIN, File
from study.artifact.reads import Setting, SourcesOf
from study.experiments.kit.base import experiment, scene_of

log = logging.getLogger(__name__)


@experiment(
    "Mesh {mesh}",
    reads={"sources": SourcesOf("mesh"), "config": Setting("mesh")},
    writes={"out": MESH},
)
def mesh(sources: list[Path], config: MeshConfig, out: File) -> None:
    """Build the mesh of ``config``, check it and save it to ``out``.

    ``sources`` are the files from which the mesh is built. Paths in ``config`` are relative to the
    folder of the project. Raises MeshError if the mesh is not valid.
    """
    made = check_mesh(config.build(Path()), config.label)
    save_mesh(made, out.path, {"label": config.label})


@experiment(
    "Full-order runs of {scene}",
    reads={"mesh": MESH, "config": Setting("scene")},
    writes={"train": TRAIN, "heldout": HELDOUT, "kick": KICK, "stiffness": STIFFNESS},
)
def fom(mesh: File, config: SceneConfig, **runs: File) -> None:
    """Simulate the training motion and the held-out motions of a scene, each into one of ``runs``.

    The training run and, in odd frames only, the first held-out run also store projections for the
    snapshots. All other runs store positions only.
    """
    frames, plans = config.frames, config.reduce
    wanted = {
        "train": {group: sets.stored_frames(frames, plan.train) for group, plan in plans.items()},
        "heldout": dict.fromkeys(plans, sets.test_frames(frames)),
    }
    for motion, file in runs.items():
        run(scene_of(config, mesh, motion), file.path, wanted.get(motion, {}))


@experiment(
    "Snapshots of {group} in {scene}",
    reads={"mesh": MESH, "train": TRAIN, "heldout": HELDOUT, "config": Setting("scene")},
    writes={"out": SNAPSHOTS},
)
def snapshots(mesh: File, train: File, heldout: File, config: SceneConfig, out: File) -> None:
    """Collect snapshots of the group ``out["group"]`` from two full-order runs into ``out``."""
    group = out["group"]
    scene = scene_of(config, mesh)
    frames = sets.training_frames(scene.config.frames, scene.config.reduce[group].train)
    found = sets.collect(train.path, heldout.path, scene.group(group), scene.masses, frames)
    sets.save_snapshots(found, out.path)


@experiment(
    "POD of {group} in {scene} ({basis})",
    reads={"snapshots": SNAPSHOTS, "spec": Setting("basis")},
    writes={"out": BASIS},
)
def pod(snapshots: File, spec: BasisSpec, out: File) -> None:
    """Compute the basis of ``spec`` from the training ``snapshots`` and save it to ``out``."""
    data = sets.load_snapshots(snapshots.path)
    basis = basis_of(data, spec)
    log.info("numerical rank %d of %d snapshots", basis.rank, len(data.train))
    save_basis(basis, out.path)
