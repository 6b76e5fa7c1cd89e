"""Make the mesh of a scene, its full-order runs, and the snapshots of each reduced group."""

from pathlib import Path

from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.config import MeshConfig
from pdrom.model.mesh.types import save_mesh
from pdrom.model.runs import run
from pdrom.model.scene import SceneConfig
from pdrom.reduction import snapshots as sets
from study.artifact.paths import HELDOUT, KICK, MESH, SNAPSHOTS, STIFFNESS, TRAIN, File
from study.artifact.reads import Setting, SourcesOf
from study.experiments.kit.base import experiment, scene_of


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
    """Simulate the training trajectory and the test trajectories of a scene, one for each file.

    The training run and, in odd frames only, the first test run (``heldout``) also store
    projections for the snapshots. All other runs store positions only.
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
