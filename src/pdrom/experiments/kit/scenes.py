"""Scene of a run bound to its mesh file, and that run, for several experiments."""

import numpy as np

from pdrom.core.paths import File
from pdrom.core.store import open_hdf5
from pdrom.model.mesh.types import load_mesh
from pdrom.model.scene import Scene, SceneConfig

RUNS = ("train", "heldout")


def scene_of(config: SceneConfig, mesh: File, run: str = "train", threads: int = 1) -> Scene:
    """Scene of ``run`` ("train" or "heldout") on its mesh file."""
    chosen = config.heldout_variant() if run == "heldout" else config
    scene = Scene.build(chosen, load_mesh(mesh.path), threads)
    scene.log_holds()
    return scene


def positions_of(run: File, frames: int | None = None) -> np.ndarray:
    """Positions (F + 1, N, 3) m of a full-order run, or of its first ``frames``."""
    with open_hdf5(run.path) as file:
        return file["positions"][: None if frames is None else frames + 1]
