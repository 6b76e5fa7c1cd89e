"""Runs in files, which ``pdrom show`` and ``pdrom view`` open, too."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from pdrom.api.runs import FullRun, ReducedRun, full_run
from pdrom.api.scenes import bound
from pdrom.core.errors import StorageError
from pdrom.core.provenance import made_by
from pdrom.core.store import open_hdf5, write_hdf5
from pdrom.core.yamlfile import validate
from pdrom.model.mesh.types import store_mesh, stored_mesh
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.local.guard import GuardRecord
from pdrom.reduction.rerun import Rerun, displacement_norms


def save(reduced: ReducedRun, path: str | os.PathLike[str]) -> None:
    """Write a reduced run with its full-order run, as positions in single precision."""
    config = reduced.full.scene.config.model_dump(mode="json")
    labels = {"group": reduced.group, "method": reduced.method, "r": reduced.r}
    outcome = reduced.outcome
    with made_by("pdrom.api.save", {"scene": config, **labels}), write_hdf5(path) as file:
        file.attrs.update(labels | {"gain": reduced.gain, "ms_per_frame": reduced.ms})
        file.attrs["blowup_frame"] = -1 if outcome.blowup_frame is None else outcome.blowup_frame
        seen = {key: told for key, told in reduced.seen.columns().items() if told is not None}
        file.attrs.update({**seen, "guard_stopped": reduced.seen.stopped})
        store_mesh(reduced.full.scene.mesh, file.create_group("mesh"))
        _store(file, "reduced", outcome.positions.astype(np.float32), "m")
        _store(file, "full", reduced.full.positions.astype(np.float32), "m")
        _store(file, "full_ms", reduced.full.ms, "ms")
        _store(file, "difference", outcome.difference, "m")
        _store(file, "shape_difference", outcome.shape_difference, "m")
        _store(file, "error", reduced.error, "1")
        _store(file, "extent", outcome.extent, "1")
        _store(file, "displacement", displacement_norms(reduced.full.positions), "m")


def load(path: str | os.PathLike[str]) -> FullRun | ReducedRun:
    """A run that `save`, `pdrom.api.run` or the pipeline wrote.

    Raises
    ------
    StorageError
        The file is missing, damaged, or holds no run of a scene.
    """
    with open_hdf5(path) as file:
        if "positions" in file and "timings" in file:
            return full_run(_scene(file, path), file)
        if "reduced" in file and "full" in file:
            return _reduced(_scene(file, path), file)
    raise StorageError(f"{path}: holds no run that could be opened here (pdrom show says what)")


def _store(file: h5py.File, name: str, values: np.ndarray, unit: str) -> None:
    file[name] = values
    file[name].attrs["unit"] = unit


def _reduced(scene: Scene, file: h5py.File) -> ReducedRun:
    full = FullRun(scene, file["full"][...].astype(float), file["full_ms"][...], {})
    positions, blowup = file["reduced"][...].astype(float), int(file.attrs["blowup_frame"])
    outcome = Rerun(
        positions,
        file["difference"][...],
        file["shape_difference"][...],
        file["extent"][...],
        None if blowup < 0 else blowup,
        positions,
    )
    group, method = str(file.attrs["group"]), str(file.attrs["method"])
    r, gain, ms = int(file.attrs["r"]), float(file.attrs["gain"]), float(file.attrs["ms_per_frame"])
    return ReducedRun(full, group, method, r, gain, outcome, ms, _seen(file.attrs))


def _seen(told: Mapping[str, Any]) -> GuardRecord:
    """What the guard saw; nothing in a file without one."""
    if "guard_count" not in told:
        return GuardRecord.unwatched()
    frame, reason = told.get("guard_frame"), told.get("guard_reason")
    estimate = told.get("guard_estimate")
    return GuardRecord(
        frame=None if frame is None else int(frame),
        reason=None if reason is None else str(reason),
        count=int(told["guard_count"]),
        fallback_frames=int(told["fallback_frames"]),
        estimate=None if estimate is None else float(estimate),
        stopped=bool(told["guard_stopped"]),
    )


def _scene(file: h5py.File, path: str | os.PathLike[str]) -> Scene:
    """The scene of a run; its mesh from the file, where it was stored."""
    config = json.loads(file.attrs["configuration"])["scene"]
    scene = validate(SceneConfig, config, str(path))
    if "mesh" in file:
        return Scene.build(scene, stored_mesh(file["mesh"]))
    return bound(scene, Path(), str(path))
