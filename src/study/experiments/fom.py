"""A full-order run, with the snapshots that the scene's reductions need."""

from pdrom.model.runs.full_order import run
from pdrom.model.scene import SceneConfig
from pdrom.reduction.snapshots import stored_frames, test_frames
from study.artifact.paths import FULL_ORDER, MESH, File
from study.artifact.reads import Setting
from study.experiments.kit.declaration import experiment
from study.experiments.kit.scenes import SPLITS, TRAIN, scene_of
from study.experiments.kit.settings import Solver


@experiment(
    "Full-order run of {scene} ({run})",
    reads={
        "mesh": MESH,
        "config": Setting("scene"),
        "solver": Setting("solver"),
    },
    writes={"out": FULL_ORDER},
)
def fom(mesh: File, config: SceneConfig, solver: Solver, out: File) -> None:
    """Simulate one of a scene's runs; the first held-out one stores the odd frames only.

    Of the other held-out ones nothing but the positions is used.
    """
    motion = out["run"]
    scene = scene_of(config, mesh, motion)
    frames = scene.config.frames
    plans = scene.config.reduce if motion in SPLITS else {}
    wanted = {
        group: stored_frames(frames, plan.train) if motion == TRAIN else test_frames(frames)
        for group, plan in plans.items()
    }
    run(scene, out.path, wanted, solver)
