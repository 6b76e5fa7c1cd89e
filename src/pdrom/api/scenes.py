"""Scenes from a file or from keys."""

import os
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, PdromError
from pdrom.core.yamlfile import read_yaml, validate
from pdrom.model.scene import Scene, SceneConfig

SCENES = Path("config", "scenes")


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """Scene of a YAML file, bound to its mesh.

    A mesh file is looked for from the folder of the scene's file on; for a scene below
    ``config/scenes``, as in the project, from the folder that holds ``config``.

    Raises
    ------
    ConfigurationError
        Naming the file, the key and the fault.
    """
    path = Path(path)
    config = validate(SceneConfig, read_yaml(path), str(path))
    folder = path.resolve().parent
    if folder.parts[-2:] == SCENES.parts:
        folder = folder.parents[1]
    return bound(config, folder, str(path))


def build_scene(folder: str | os.PathLike[str] = ".", **keys: Any) -> Scene:
    """Scene of the keys that a scene's file has, bound to its mesh.

    Parameters
    ----------
    folder : where a mesh file is looked for
    keys : ``mesh``, ``effects`` and ``frames`` are required, see config/README.md

    Raises
    ------
    ConfigurationError
        Naming the key and the fault.
    """
    named = {"name": "scene", "title": "A scene", **keys}
    return bound(validate(SceneConfig, named, "build_scene"), Path(folder), "build_scene")


def bound(config: SceneConfig, folder: Path, source: str) -> Scene:
    """``config`` with its mesh; ConfigurationError, which ``source`` opens, for any fault."""
    try:
        return Scene.build(config, config.mesh.build(folder))
    except PdromError as error:
        raise ConfigurationError(f"{source}: {error}") from error
