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
    """Return ``value``, or raise ConfigurationError if it is no ``kind``, as ``source`` makes."""
    if isinstance(value, kind):
        return value
    fault = f"a {kind.__name__} is required ({source})"
    raise ConfigurationError(f"{name} = {shown(value, 60)}: {fault}")


def require_run(value: Any, name: str) -> Run:
    """Return ``value`` if it is a run; SnapshotError if it is a run that is not finite."""
    run = require(Run, value, name, source="run, Model.run and load make one")
    run.require_finite(name)
    return run


def require_runnable(scene: Any, out: Any, function: Any, name: str = "on_frame") -> None:
    """Raise ConfigurationError or StorageError unless a run can have these arguments."""
    require(Scene, scene, "scene", source="build_scene and load_scene make one")
    try:
        signature(function).bind(0, None)
    except (TypeError, ValueError) as error:
        fault = "a function of two arguments is required"
        raise ConfigurationError(f"{name} = {shown(function, 60)}: {fault}") from error
    if out is not None:
        store.require_own(file_path(out))


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
        raise ConfigurationError(f"{path}: this is a result: `pdrom show {name}` says which")
    if kind in READERS:
        made = f"`pdrom new --mesh {name}` makes a scene of it"
        raise ConfigurationError(f"{path}: this is a mesh: {made}")


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """Scene described by a YAML file, with its mesh.

    A relative path of a mesh file starts at the folder of the YAML file.

    Parameters
    ----------
    path : the YAML file

    Raises
    ------
    ConfigurationError
        The file has a fault; the message names the file, the key and the fault.
    """
    path = file_path(path)
    require_no_mesh(path)
    config = validate(SceneConfig, named(read_yaml(path), path.stem), str(path))
    return bound(config, path.parent, str(path))


def build_scene(folder: str | os.PathLike[str] = ".", mesh: Any = None, **keys: Any) -> Scene:
    """Scene, with its mesh, from keywords, which are the keys of a scene's YAML file.

    Parameters
    ----------
    folder : folder at which a relative path of a mesh file starts
    mesh : a mapping, as in a scene's file; or a pair of arrays: points (N, 3) m with triangles
        (T, 3) or tetrahedra (E, 4) of indices of points, from 0
    keys : ``effects`` and ``frames`` are required, see config/README.md; ``name`` and ``title``
        have default values

    Raises
    ------
    ConfigurationError
        A keyword has a fault; the message names the key and the fault.
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
    """Scene of ``config``; a mesh file's path is relative to ``folder``; errors name ``source``."""
    try:
        return Scene.build(config, config.mesh.build(folder))
    except PdromError as error:
        raise ConfigurationError(f"{source}: {error}") from error


def save(run: Run, path: str | os.PathLike[str]) -> None:
    """Write a run to a file, from which `load` reads it bit for bit.

    Parameters
    ----------
    run : run by `pdrom.api.run` or `Model.run`
    path : file (HDF5) to write

    Raises
    ------
    ConfigurationError, StorageError
        ``run`` is no run; the file cannot be written.
    """
    require_run(run, "run")
    path = file_path(path)
    store.require_own(path)
    config = {"scene": run.scene.config.model_dump(mode="json"), "method": run.method}
    with made_by("pdrom.api.save", config), store.write_hdf5(path) as file:
        store_run(run, file)


def load(path: str | os.PathLike[str], unchecked: bool = False) -> Run:
    """Read a run that `save`, `pdrom.api.run` or the pipeline wrote.

    Parameters
    ----------
    path : file (HDF5); it is never changed or renamed, even if it is damaged
    unchecked : whether to read a file without a checksum if its arrays are complete, finite and of
        the shapes that its scene gives. A wrong checksum is never accepted.

    Raises
    ------
    StorageError
        The file is missing, damaged, without a checksum, or has links to other files; it contains
        no run of a scene, or lacks data that its scene requires.
    """
    path = file_path(path)
    with opened(path, "run", unchecked) as file:
        if "reduced" in file or "requested_error" in file.attrs:
            raise StorageError(f"{path}: a reduced run of an earlier pdrom; make it again")
        if "positions" not in file or "timings" not in file:
            raise StorageError(f"{path}: holds no run that could be opened; see pdrom show")
        found = stored_run(_scene(file, path), file)
        _require_consistent(found, file)
        return found


@contextmanager
def opened(path: Path, what: str, unchecked: bool = False) -> Iterator[h5py.File]:
    """Open the file ``path`` to read a ``what`` from it; StorageError for any fault of it."""
    if path.is_file() and not h5py.is_hdf5(path):
        raise StorageError(f"{path}: holds no {what}: it is no HDF5 file")
    try:
        with store.open_hdf5(path, unchecked) as file:
            store.require_self_contained(file, path)
            yield file
    except StorageError:
        raise
    except (PdromError, ValueError, TypeError, LookupError, RuntimeError, AttributeError) as error:
        fault = " ".join(str(error).split())[:200]
        raise StorageError(f"{path}: holds no sound {what} ({fault})") from error


def _require_consistent(found: Run, file: h5py.File) -> None:
    """Raise ValueError if an array in ``file`` is not finite, or contradicts the run ``found``."""
    found.require_finite("run")
    scene, moved, points = found.scene, found.positions, found.scene.mesh.points
    frames, h = scene.config.frames, scene.config.time_step
    pairs = [  # fault, stored and expected numbers
        ("frame 0 of the positions is not the mesh", moved[0], points),
        ("a time is below zero", found.ms, np.abs(found.ms)),
    ]
    if "velocities" in file:
        before = moved[:1] - h * scene.initial_state().velocities
        steps = np.diff(moved, axis=0, prepend=before) / h
        stored = file["velocities"][...]
        pairs.append(("velocities are not those of the positions", stored, steps))
    if "objective" in file and isinstance(scene.config.iterations, int):
        known, shape = np.zeros((frames, scene.config.iterations)), file["objective"].shape
        pairs.append((f"objective of shape {shape}", np.zeros(shape), known))
    for name, own in file.get("snapshots", {}).items():
        group = scene.group(name)
        sizes = [int(own.attrs[key]) for key in ("elements", "rows_per_element")]
        if sizes != [group.elements, group.rows_per_element]:
            raise ValueError(f"snapshots of {name}: elements and rows {sizes}")
    for fault, stored, expected in pairs:
        least = 1e-6 * np.abs(expected).max(initial=0.0)
        if stored.shape != expected.shape or not (np.abs(stored - expected) <= least).all():
            raise ValueError(fault)


def _scene(file: h5py.File, path: Path) -> Scene:
    """Scene of the run in ``file`` at ``path``, with the stored mesh, else its configured mesh."""
    settings = json.loads(file.attrs["configuration"])
    # the pipeline stores the scene under the key "config", `save` and `run` under "scene"
    keys = settings.get("config") or settings["scene"]
    keys.pop("requested_error", None)  # an earlier pdrom stored this key, which changed no run
    scene = validate(SceneConfig, keys, str(path))
    if "mesh" in file:
        return Scene.build(scene, stored_mesh(file["mesh"]))
    # a relative path of a mesh starts at the nearest folder above the run's file that has the mesh
    mesh, above = scene.mesh, path.resolve().parents
    named = [f for f in above if isinstance(mesh, MeshFile) and (f / mesh.path).is_file()]
    return bound(scene, [*named, Path()][0], str(path))
