"""Scenes of config/scenes, coarsened as a study asks, and built to find every fault early."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

from pydantic import Field

from pdrom.core.errors import ConfigurationError, PdromError, choices
from pdrom.core.names import named
from pdrom.core.yamlfile import ConfigModel, read_yaml, validate
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.scene import Scene, SceneConfig

Fraction = Annotated[float, Field(gt=0.0, le=1.0)]


class Coarsen(ConfigModel):
    """Factors on mesh resolution (vertices along a side) and on every frame number."""

    resolution: Fraction = 1.0
    frames: Fraction = 1.0


def scene_names(root: Path) -> list[str]:
    """Names of all scenes that have a file."""
    return sorted(path.stem for path in (root / "config" / "scenes").glob("*.yaml"))


def require_scenes(root: Path, names: Iterable[str], key: str) -> None:
    """ConfigurationError, which ``key`` opens, for a name without a file in config/scenes."""
    known = scene_names(root)
    for name in names:
        if name not in known:
            raise ConfigurationError(f"{key}: unknown scene '{name}'{choices(name, known)}")


def load_scene(root: Path, name: str, coarsen: Coarsen | None = None) -> SceneConfig:
    """Configuration of scene ``name``, see `load_bound_scene`."""
    return load_bound_scene(root, name, coarsen).config


def load_bound_scene(root: Path, name: str, coarsen: Coarsen | None = None) -> Scene:
    """Scene ``name`` from config/scenes, coarsened, and built to find every fault early.

    Raises
    ------
    ConfigurationError
        Naming the file and the fault; also for faults of the held-out variant.
    """
    return bind(root, read_scene(root, name, coarsen), str(scene_file(root, name)))


def bind(root: Path, scene: SceneConfig, source: str) -> Scene:
    """Scene of a configuration; ``source`` opens the messages about its faults.

    Raises
    ------
    ConfigurationError
        Naming the fault; also for those of the held-out variant.
    """
    try:
        mesh = scene.mesh.build(root)
        bound = Scene.build(scene, mesh)
        # its groups are those of the scene: what differs is built alone
        heldout = scene.heldout_variant()
        other = tuple(e for e in heldout.effects if not isinstance(e, GroupConfig))
        Scene.build(heldout.model_copy(update={"effects": other}), mesh)
    except PdromError as error:
        raise ConfigurationError(f"{source}: {error}") from error
    bound.log_holds()
    bound.log_contacts()
    return bound


def read_scene(root: Path, name: str, coarsen: Coarsen | None = None) -> SceneConfig:
    """Configuration of scene ``name``, coarsened, without its mesh; ConfigurationError."""
    require_scenes(root, [name], "scenes")
    path = scene_file(root, name)
    scene = validate(SceneConfig, named(read_yaml(path), name), str(path))
    if scene.name != name:
        raise ConfigurationError(f"{path}: name = '{scene.name}', required: '{name}', as the file")
    if coarsen is not None and coarsen != Coarsen():
        scene = scene.coarsened(coarsen.resolution, coarsen.frames)
    return scene


def scene_file(root: Path, name: str) -> Path:
    """The file of scene ``name``."""
    return root / "config" / "scenes" / f"{name}.yaml"
