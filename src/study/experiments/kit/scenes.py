"""Scene of a run bound to its mesh file, and that run, for several experiments."""

from typing import cast

import numpy as np

from pdrom.core.store import open_hdf5
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
