"""Full-order runs of a scene, with the snapshots that its reductions need."""

from pdrom.model.runs.full_order import run
from pdrom.model.scene import SceneConfig
from pdrom.reduction.snapshots import stored_frames, test_frames
from study.artifact.paths import HELDOUT, KICK, MESH, STIFFNESS, TRAIN, File
from study.artifact.reads import Setting
from study.experiments.kit.declaration import experiment
from study.experiments.kit.scenes import scene_of
from study.experiments.kit.settings import Solver


@experiment(
    "Full-order runs of {scene}",
    reads={"mesh": MESH, "config": Setting("scene"), "solver": Setting("solver")},
    writes={"train": TRAIN, "heldout": HELDOUT, "kick": KICK, "stiffness": STIFFNESS},
)
def fom(mesh: File, config: SceneConfig, solver: Solver, **runs: File) -> None:
    """Simulate the training and the held-out ``runs`` of a scene, each into its file.

    The first held-out one stores the projections of the odd frames only; of the other ones nothing
    but the positions is used.
    """
    frames, plans = config.frames, config.reduce
    wanted = {
        "train": {group: stored_frames(frames, plan.train) for group, plan in plans.items()},
        "heldout": dict.fromkeys(plans, test_frames(frames)),
    }
    for motion, file in runs.items():
        run(scene_of(config, mesh, motion), file.path, wanted.get(motion, {}), solver)
