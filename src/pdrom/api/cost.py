"""Comparison of iterations, coarser meshes and models of a scene by error and time."""

import logging
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pdrom.api import files
from pdrom.api.model import Model, load_model, silent, timed
from pdrom.api.records import standstill
from pdrom.api.training import EVALUATIONS, Progress, converged_reference, tolerance_of
from pdrom.core.errors import ConfigurationError, NotReducibleError, PdromError
from pdrom.core.yamlfile import shown
from pdrom.model.coarser import Coarser, error_of_mesh, grids, on_mesh
from pdrom.model.mesh.config import MeshFile
from pdrom.model.mesh.types import Mesh
from pdrom.model.scene import Scene
from pdrom.reduction import settings
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.settings import Setting
from pdrom.reduction.subspace.model import SubspaceModel, reduced

log = logging.getLogger(__name__)
# Pairs (iterations of a frame, window of Anderson acceleration or 0); fewer on coarser meshes.
COUNTS = ((1, 0), (2, 0), (3, 0), (5, 0), (10, 0), (5, 5), (10, 5))
ON_COARSER = ((2, 0), (5, 0), (5, 5))
PARTS = (1 / 2, 1 / 3, 1 / 4)  # cells along a side of a coarser grid, relative to a generated grid
ITERATIONS = 5  # of a model in a frame that is not solved to convergence
FRAMES, REPEATS = 60, 3  # largest number of timed frames, and timed runs
ERRORS = ["position_error", "deformation_error"]


def cost(
    scene: Scene,
    coarser: Sequence[Mesh | str | os.PathLike[str]] = (),
    models: Sequence[Model | str | os.PathLike[str]] = (),
    progress: Progress = lambda name, frames: silent,
) -> pd.DataFrame:
    """Compare iterations, coarser meshes and models of a scene by error and time.

    scene : scene made by `build_scene` or `load_scene`
    coarser : meshes with fewer vertices, or their files; by default, a scene on a generated grid
        gets grids with a half, a third and a quarter of its cells along a side
    models : models of the scene's mesh, or their files
    progress : called with name and number of frames of the converged run; returns a function that
        is called after each frame

    Returns a table, fastest first: ``setting`` in words, ``method``, ``iterations`` of a frame
    (NA: converged), ``vertices`` that are simulated, `ERRORS` against converged steps (NaN: rigid
    body, inf: blew up), ``ms`` per frame, ``best`` (Pareto-optimal in position error and
    time). ``attrs``: number of timed ``frames``, ``busy`` (times are unreliable, since other
    programs ran), ``mesh_error`` (see `error_of_mesh`). Raises PdromError if an argument or file is
    invalid, a model has another mesh, a frame does not converge, or nothing moves.
    """
    files.require_runnable(scene, None, progress, "progress")
    for given, what in ((coarser, "coarser"), (models, "models")):
        if not isinstance(given, (list, tuple)):
            raise ConfigurationError(f"{what} = {shown(given, 60)}: a list is required")
    name, frames = scene.config.name, scene.config.frames
    meshes = [_coarser(scene, each) for each in coarser] or _grids(scene)
    meshes.sort(key=lambda each: -each.scene.mesh.vertices)
    tried = list(_full_order(scene, meshes))
    for number, model in enumerate(models, start=1):
        with _naming(model):
            tried += _of_model(scene, model, number)
    reference = converged_reference(scene, progress).positions
    if still := standstill(scene, reference):
        raise NotReducibleError(f"scene '{name}': {still}")
    truth, rows = Yardstick(scene, reference), []
    for number, setting in enumerate(tried, start=1):
        log.info("%s: setting %d of %d, %s", name, number, len(tried), setting.labels["setting"])
        found, *errors = setting.errors(truth)
        errors = [np.inf, np.inf] if found is None else errors
        rows.append({**setting.labels, **dict(zip(ERRORS, errors, strict=True))})
    table = pd.DataFrame(rows).astype({"iterations": "Int64", **dict.fromkeys(ERRORS, float)})
    few, order = min(FRAMES, frames), np.random.default_rng(0).permutation(len(tried))
    log.info("%s: timing all settings in turn, over %d frames", name, few)
    times, busy = timed([tried[i].variant({}, few) for i in order], REPEATS)
    table.loc[order, "ms"] = times
    best = settings.pareto(table.position_error.tolist(), table.ms.tolist())
    table["best"] = np.array(best) & np.isfinite(table.position_error)
    log.info("%s: estimating the error of the mesh by coarser meshes", name)
    ends = meshes[:: max(1, len(meshes) - 1)]
    runs = [mesh.converged(tolerance_of(mesh.scene), EVALUATIONS) for mesh in ends[1:] and ends]
    table = table.sort_values("ms", ignore_index=True)
    mesh_error = error_of_mesh(reference, ends, runs)
    table.attrs = {"frames": few, "busy": busy, "mesh_error": mesh_error}
    return table


@contextmanager
def _naming(given: Any) -> Iterator[None]:
    """Begin messages of errors about ``given`` with its path if it is a file."""
    path = None if isinstance(given, (Mesh, Model)) else files.file_path(given)
    try:
        yield
    except PdromError as error:
        if path is None:
            raise
        fault = str(error).removeprefix(f"{path}: ").removeprefix(f"{path.name}: ")
        raise type(error)(f"{path}: {fault}") from error


def _coarser(scene: Scene, given: Any) -> Coarser:
    """Return ``scene`` on the mesh ``given``; a file is read with the scene's mesh settings."""
    own, path = scene.config.mesh, Path() if isinstance(given, Mesh) else files.file_path(given)
    like = own if isinstance(own, MeshFile) else MeshFile(kind="file", path="any")
    file = like.model_copy(update={"path": path.name})
    with _naming(given):
        return on_mesh(scene, given if isinstance(given, Mesh) else file.build(path.parent))


def _grids(scene: Scene) -> list[Coarser]:
    """Return ``scene`` on coarser grids; leave out grids on which it cannot be built."""
    found: dict[int, Coarser] = {}
    for part in PARTS:
        try:
            found |= {each.scene.mesh.vertices: each for each in grids(scene, [part])}
        except PdromError as error:
            log.warning("leaving out the grid with %.2g of the cells along a side: %s", part, error)
    return [*found.values()]


def _full_order(scene: Scene, meshes: Sequence[Coarser]) -> Iterator[Setting]:
    config = scene.config
    counts = dict.fromkeys((*COUNTS, (config.count, config.anderson_window)))
    own, coarse = (settings.full_order(scene, *a) for a in ((counts,), (ON_COARSER, meshes)))
    for setting in (*own, *coarse):
        count, method = (setting.labels[key] for key in ("iterations", "method"))
        words = f"{count} iteration{'s' * (count > 1)}"
        words += ", Anderson" * (method in (settings.ANDERSON, settings.COARSER_ANDERSON))
        if (size := setting.labels["vertices"]) < scene.mesh.vertices:
            words += f" on {size:,} vertices"
        yield replace(setting, labels={"setting": words, **setting.labels})


def _of_model(scene: Scene, given: Any, number: int) -> Iterator[Setting]:
    """Yield settings of a model or its file; raise an error if it cannot run ``scene``."""
    own = isinstance(given, Model)
    model, name = (given, number) if own else (load_model(given), files.file_path(given).name)
    for count, solved in ((ITERATIONS, f"{ITERATIONS} iterations"), (None, "converged")):
        labels = {"setting": f"model {name}, {solved}", "method": "model", "iterations": count}
        labels["vertices"] = scene.mesh.vertices
        loop = model.loop(scene.iterated(ITERATIONS), solver="local_global")
        if isinstance(model.reduced, SubspaceModel):
            with suppress(NotReducibleError):  # Newton's method needs derivatives of every group
                yield reduced(labels, scene, model.reduced, count, newton=count is None)
        elif count:
            yield Setting(labels, *loop)
