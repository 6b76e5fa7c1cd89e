"""Scenes from YAML files or keywords, and runs saved to HDF5 files and loaded from them."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from inspect import signature
from pathlib import Path
from shlex import quote
from typing import Any, TypeVar

import h5py
import numpy as np

from pdrom.api.records import Run, store_run, stored_run
from pdrom.core import store
from pdrom.core.errors import ConfigurationError, PdromError, StorageError
from pdrom.core.provenance import made_by
from pdrom.core.yamlfile import check_lengths, named, read_yaml, shown, validate
from pdrom.model.mesh.config import GivenMesh, MeshFile, given_mesh
from pdrom.model.mesh.reader import READERS
from pdrom.model.mesh.types import stored_mesh
from pdrom.model.scene import Scene, SceneConfig

T = TypeVar("T")


def require(kind: type[T], value: Any, name: str, source: str) -> T:
    """Return ``value``; ConfigurationError, with the hint ``source``, if it is not a ``kind``."""
    if isinstance(value, kind):
        return value
    fault = f"a {kind.__name__} is required ({source})"
    raise ConfigurationError(f"{name} = {shown(value, 60)}: {fault}")


def require_run(value: Any, name: str) -> Run:
    """Return ``value`` if it is a run, with finite numbers; SnapshotError if they are not."""
    run = require(Run, value, name, source="made by run, Model.run or load")
    run.require_finite(name)
    return run


def require_runnable(scene: Any, out: Any, function: Any, name: str = "on_frame") -> None:
    """Check the arguments of a run; ConfigurationError or StorageError for an invalid one."""
    require(Scene, scene, "scene", source="made by build_scene or load_scene")
    try:
        signature(function).bind(0, None)
    except (TypeError, ValueError) as error:
        fault = "a function of two arguments is required"
        raise ConfigurationError(f"{name} = {shown(function, 60)}: {fault}") from error
    if out is not None:
        output(out)


def output(path: Any) -> Path:
    """Return ``path``; StorageError or ConfigurationError if pdrom cannot or may not write it."""
    store.require_own(file_path(path))
    return Path(path)


def file_path(path: Any) -> Path:
    """Return ``path`` as a `Path`; ConfigurationError if it cannot be one."""
    try:
        check_lengths(os.fspath(path))
        if "\0" in os.fspath(path):
            raise ValueError("it has a zero byte")
        return Path(path)
    except (TypeError, ValueError) as error:
        fault = f"{shown(path, 60)}: the name of a file is required"
        raise ConfigurationError(f"{fault} ({error})") from error


def require_no_mesh(path: Path) -> None:
    """Raise ConfigurationError if the file ``path`` is a result or a mesh, not a scene."""
    kind, name = path.suffix.lower() * path.is_file(), quote(str(path))
    if kind in (".h5", ".hdf5"):
        raise ConfigurationError(f"{path}: a result, not a scene; see `pdrom show {name}`")
    if kind in READERS:
        made = f"`pdrom new --mesh {name}` writes a scene for it"
        raise ConfigurationError(f"{path}: a mesh, not a scene; {made}")


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """Read the scene that the YAML file ``path`` describes, with its mesh.

    The path of a mesh file is relative to the folder of the YAML file. Raises ConfigurationError,
    which names the file, the key and the fault.
    """
    path = file_path(path)
    require_no_mesh(path)
    config = validate(SceneConfig, named(read_yaml(path), path.stem), str(path))
    return bound(config, path.parent, str(path))


def build_scene(folder: str | os.PathLike[str] = ".", mesh: Any = None, **keys: Any) -> Scene:
    """Build a scene from keyword arguments, which are the keys of a scene's YAML file.

    Raises ConfigurationError, which names the key and the fault.

    folder : folder to which the path of a mesh file is relative
    mesh : a mapping, as in a scene's file; or a pair of arrays: points (N, 3) m with triangles
        (T, 3) or tetrahedra (E, 4) of indices of points, from 0
    keys : ``effects`` and ``frames`` are required, see config/README.md; ``name`` and ``title``
        have default values
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
    """Build the scene of ``config``, with mesh files in ``folder``; errors name ``source``."""
    try:
        return Scene.build(config, config.mesh.build(folder))
    except PdromError as error:
        raise ConfigurationError(f"{source}: {error}") from error


def save(run: Run, path: str | os.PathLike[str]) -> None:
    """Write a ``run`` to the file ``path`` (HDF5), from which `load` reads it bit for bit."""
    require_run(run, "run")
    path = output(path)
    config = {"scene": run.scene.config.model_dump(mode="json"), "method": run.method}
    with made_by("pdrom.api.save", config), store.write_hdf5(path) as file:
        store_run(run, file)


def load(path: str | os.PathLike[str], unchecked: bool = False) -> Run:
    """Read a run from the file ``path`` (HDF5) that `save`, `pdrom.api.run` or the pipeline wrote.

    The file is never changed. ``unchecked`` accepts a file without a checksum, but not a wrong
    checksum. Raises StorageError if the file is missing, damaged or without a checksum, links to
    other files, or if data of its scene are missing, not finite or of a wrong shape.
    """
    path = file_path(path)
    with opened(path, "run", unchecked) as file:
        if "positions" not in file or "timings" not in file:
            raise StorageError(f"{path}: contains no complete run; pdrom show lists its contents")
        found = stored_run(_scene(file, path), file)
        _require_consistent(found)
        return found


@contextmanager
def opened(path: Path, what: str, unchecked: bool = False) -> Iterator[h5py.File]:
    """Open the file ``path`` to read a ``what`` from it; StorageError if the file is invalid."""
    if path.is_file() and not h5py.is_hdf5(path):
        raise StorageError(f"{path}: contains no {what}, because it is not an HDF5 file")
    try:
        with store.open_hdf5(path, unchecked) as file:
            store.require_self_contained(file, path)
            yield file
    except StorageError:
        raise
    except (PdromError, ValueError, TypeError, LookupError, RuntimeError, AttributeError) as error:
        fault = " ".join(str(error).split())[:200]
        raise StorageError(f"{path}: contains no valid {what} ({fault})") from error


def _require_consistent(found: Run) -> None:
    found.require_finite("run")
    points = found.scene.mesh.points
    if np.abs(found.positions[0] - points).max() > 1e-6 * np.abs(points).max():
        raise ValueError("positions of frame 0 differ from the mesh")
    if found.ms.min(initial=0.0) < 0.0:
        raise ValueError("a time is negative")


def _scene(file: h5py.File, path: Path) -> Scene:
    """Build the scene of the run in ``file`` at ``path``, with the stored or configured mesh."""
    settings = json.loads(file.attrs["configuration"])
    # the pipeline stores the scene under the key "config", `save` and `run` under "scene"
    keys = settings.get("config") or settings["scene"]
    keys.pop("requested_error", None)  # an earlier pdrom stored this key, which changed no run
    scene = validate(SceneConfig, keys, str(path))
    if "mesh" in file:
        return Scene.build(scene, stored_mesh(file["mesh"]))
    # a mesh path is relative to the nearest folder above the run's file in which the mesh exists
    mesh, above = scene.mesh, path.resolve().parents
    named = [f for f in above if isinstance(mesh, MeshFile) and (f / mesh.path).is_file()]
    return bound(scene, [*named, Path()][0], str(path))
