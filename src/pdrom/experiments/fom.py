"""A full-order run, with the snapshots that the scene's reductions need."""

from dataclasses import dataclass
from typing import Annotated

from pdrom.core.paths import FULL_ORDER, MESH, File
from pdrom.experiments.kit.declaration import Experiment, JobSettings
from pdrom.experiments.kit.scenes import scene_of
from pdrom.experiments.kit.settings import Solver, Threads
from pdrom.model.runs.full_order import run as run_full_order
from pdrom.model.scene import SceneConfig
from pdrom.reduction.snapshots import stored_frames, test_frames


class Settings(JobSettings):
    """What a full-order run depends on."""

    scene: SceneConfig
    solver: Solver
    threads: Threads


@dataclass(frozen=True)
class Inputs:
    """Files read."""

    mesh: Annotated[File, MESH]


@dataclass(frozen=True)
class Outputs:
    """Files written."""

    run: Annotated[File, FULL_ORDER]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Simulate one of a scene's runs; the held-out one stores the odd frames only."""
    motion = outputs.run["run"]
    scene = scene_of(settings.scene, inputs.mesh, motion, settings.threads)
    frames = scene.config.frames
    wanted = {
        group: test_frames(frames) if motion == "heldout" else stored_frames(frames, plan.train)
        for group, plan in scene.config.reduce.items()
    }
    run_full_order(scene, outputs.run.path, wanted, settings.solver)


EXPERIMENT = Experiment("fom", "Full-order run of {scene} ({run})", run)
