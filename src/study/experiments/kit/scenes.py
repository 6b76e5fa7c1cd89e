"""Scene of a run bound to its mesh file, that run, other starts, and another time step."""

from collections.abc import Sequence
from typing import cast

import numpy as np

from pdrom.core.store import open_hdf5
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.held_out import HeldOutMotion
from pdrom.model.mesh.types import load_mesh
from pdrom.model.scene import Scene, SceneConfig
from study.artifact.paths import File

TRAIN = "train"


def scene_of(config: SceneConfig, mesh: File, run: str = TRAIN) -> Scene:
    """Scene of ``config`` and ``run`` ("train" or a held-out motion) on its mesh file."""
    chosen = config if run == TRAIN else config.heldout_variant(cast(HeldOutMotion, run))
    scene = Scene.build(chosen, load_mesh(mesh.path))
    scene.log_holds()
    return scene


def positions_of(run: File, frames: int | None = None) -> np.ndarray:
    """Positions (F + 1, N, 3) m of a full-order run, or of its first ``frames``."""
    with open_hdf5(run.path) as file:
        return file["positions"][: None if frames is None else frames + 1]


def followed(loop: Stepper, state: State, frames: int) -> np.ndarray:
    """Positions (F + 1, N, 3) m that ``loop`` reaches from ``state`` on, the first ones first."""
    ends = [after.positions for after, _ in loop.run(state, range(frames))]
    return np.stack([state.positions, *ends])


def perturbation_field(scene: Scene, size: float, seed: int) -> np.ndarray:
    """Random directions by ``seed``, of length ``size`` times the extent of ``scene``, (N, 3) m."""
    field = np.random.default_rng(seed).standard_normal((scene.mesh.vertices, 3))
    return size * scene.mesh.extent * field / np.linalg.norm(field, axis=1, keepdims=True)


def varied(
    config: SceneConfig,
    time_step: float,
    stiffness_ratio: float,
    duration: float,
    frames: Sequence[int],
) -> SceneConfig:
    """``config`` with ``time_step`` (s) and the reduced groups' weights times ``stiffness_ratio``.

    Schedules keep their times in seconds, so that their frame numbers change. The run takes
    ``duration`` seconds, but at least ``frames[0]`` and at most ``frames[1]`` frames. The other
    groups keep their weights.
    """
    count = min(max(round(duration / time_step), frames[0]), frames[1])
    effects = []
    for effect in config.effects:
        effect = effect.with_frames_scaled(config.time_step / time_step)
        if isinstance(effect, GroupConfig) and effect.effect in config.reduce:
            effect = effect.model_copy(update={"weight": stiffness_ratio * effect.weight})
        effects.append(effect)
    # the experiments, with their numbers of training snapshots, belong to the original run
    changes = {"time_step": time_step, "frames": count, "effects": tuple(effects)}
    return config.model_copy(update=changes)
