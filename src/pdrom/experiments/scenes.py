"""What several stages need: the scene of a run, bound to its mesh file."""

from typing import Any

from pdrom.model.mesh.types import load_mesh
from pdrom.model.scene import Scene, SceneConfig

RUNS = ("train", "heldout")


def scene_of(config: Any, mesh_path: Any, run: str = "train", threads: int = 1) -> Scene:
    """Scene of ``run`` ("train" or "heldout") from its plain configuration and mesh file."""
    scene = SceneConfig.model_validate(config)
    if run == "heldout":
        scene = scene.held_out_variant()
    mesh = load_mesh(getattr(mesh_path, "path", mesh_path))
    bound = Scene.build(scene, mesh, threads)
    bound.log_holds()
    return bound
