"""Scenes from a file or from keys."""

import os
from pathlib import Path
from typing import Any

from pdrom.api.arguments import file_path
from pdrom.core.errors import ConfigurationError, PdromError
from pdrom.core.names import named
from pdrom.core.yamlfile import read_yaml, validate
from pdrom.model.mesh.config import GivenMesh, given_mesh
from pdrom.model.scene import Scene, SceneConfig


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """Scene of a YAML file, bound to its mesh.

    A mesh file is looked for from the folder of the scene's file on.

    Parameters
    ----------
    path : the YAML file

    Raises
    ------
    ConfigurationError
        Naming the file, the key and the fault.
    """
    path = file_path(path)
    config = validate(SceneConfig, named(read_yaml(path), path.stem), str(path))
    return bound(config, path.parent, str(path))


def build_scene(folder: str | os.PathLike[str] = ".", mesh: Any = None, **keys: Any) -> Scene:
    """Scene of the keys that a scene's file has, bound to its mesh.

    Parameters
    ----------
    folder : where a mesh file is looked for
    mesh : a mapping, as in a scene's file; or a pair of arrays: points (N, 3) m with triangles
        (T, 3) or tetrahedra (E, 4), which name points from 0 on
    keys : ``effects`` and ``frames`` are required, see config/README.md; ``name`` and ``title``
        are given ones without them

    Raises
    ------
    ConfigurationError
        Naming the key and the fault.
    """
    keys, source = named(keys, "scene"), "build_scene"
    if not isinstance(mesh, (tuple, list)):
        keys |= {} if mesh is None else {"mesh": mesh}
        return bound(validate(SceneConfig, keys, source), file_path(folder), source)
    if len(mesh) != 2:
        raise ConfigurationError(f"{source}: mesh of {len(mesh)} parts, required: (points, cells)")
    points, cells = mesh
    made = given_mesh(points, cells, f"{source}: mesh")
    return Scene.build(validate(SceneConfig, keys | {"mesh": GivenMesh.of(made)}, source), made)


def bound(config: SceneConfig, folder: Path, source: str) -> Scene:
    """Bind ``config`` to its mesh, read below ``folder``; errors begin with ``source``."""
    try:
        return Scene.build(config, config.mesh.build(folder))
    except PdromError as error:
        raise ConfigurationError(f"{source}: {error}") from error
