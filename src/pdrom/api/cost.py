"""What accuracy costs: settings of a scene as points of error and time."""

import logging
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from time import perf_counter, process_time
from typing import Any

import numpy as np
import pandas as pd

from pdrom.api import files
from pdrom.api.model import BUSY, Model, OnFrame, load_model, silent
from pdrom.api.training import EVALUATIONS, Progress, converged_positions
from pdrom.core.errors import ConfigurationError, NotReducibleError, PdromError, SolverError
from pdrom.core.yamlfile import shown
from pdrom.model.coarser import Coarser, error_of_mesh, grids, on_mesh
from pdrom.model.mesh.config import MeshFile
from pdrom.model.mesh.types import Mesh
from pdrom.model.scene import Scene
from pdrom.reduction import settings
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.settings import Setting
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.timing import measure

log = logging.getLogger(__name__)
# Iterations of a frame and window of Anderson acceleration (0: none), on coarser meshes fewer.
WINDOW = 5
COUNTS = ((1, 0), (2, 0), (3, 0), (5, 0), (10, 0), (5, WINDOW), (10, WINDOW))
ON_COARSER = ((2, 0), (5, 0), (5, WINDOW))
PARTS = (1 / 2, 1 / 3, 1 / 4)  # of the cells along a side of a generated grid
ITERATIONS = 5  # of models, if they do not converge
FRAMES, WARMUP, REPEATS = 60, 1, 3  # most frames that are timed, and runs of them
MODEL = "model"
File = str | os.PathLike[str]


def cost(
    scene: Scene,
    coarser: Sequence[Mesh | File] = (),
    models: Sequence[Model | File] = (),
    progress: Progress = lambda name, frames: silent,
) -> pd.DataFrame:
    """Compare settings of a scene, each with its error against the converged step and its time.

    Settings are numbers of iterations, with and without Anderson acceleration, on the scene's own
    and on coarser meshes, and reduced models.

    Parameters
    ----------
    scene : scene made by `build_scene` or `load_scene`
    coarser : meshes, or their files, that fill the same space with fewer vertices; without any, a
        scene on a generated grid gets those with a half, a third and a quarter of its cells a side
    models : models of the scene's mesh, or their files
    progress : called with name and number of frames of each converged run; returns a function that
        is called after each of its frames

    Returns
    -------
    DataFrame
        Cheapest first: ``setting`` in words, ``method``, ``iterations`` of a frame (NA: until it
        has converged), ``vertices`` of the simulated mesh, ``position_error``,
        ``deformation_error`` (NaN of a rigid body; inf: blew up), ``ms`` per frame, and ``best``:
        no other setting is as good in position error and time and better in one. Its ``attrs``:
        ``frames`` (the first ones) that were timed, ``busy`` (other programs ran: times mean
        nothing), and ``mesh_error`` of the scene's mesh, estimated from two coarser ones, or None.

    Raises
    ------
    ConfigurationError, SceneError, MeshError, StorageError
        A wrong argument or file; a mesh that is no coarser one; a model of another mesh.
    SolverError
        A frame of the scene does not converge.
    """
    files.require_runnable(scene, None, silent)
    files.require_function(progress, "progress", "a name and a number")
    meshes = [_coarser(scene, each) for each in _items(coarser, "coarser")] or grids(scene, PARTS)
    meshes.sort(key=lambda each: -each.scene.mesh.vertices)
    tried = list(_full_order(scene, meshes))
    for number, model in enumerate(_items(models, "models"), start=1):
        tried += _of_model(scene, model, number)
    name, frames = scene.config.name, min(FRAMES, scene.config.frames)
    reference = converged_positions(scene, progress)
    if reference is None:
        raise SolverError(
            f"scene '{name}': a frame does not converge in {EVALUATIONS} evaluations, so that "
            "nothing tells errors; a smaller time_step or smaller weights converge sooner"
        )
    truth, rows = Yardstick(scene, reference), []
    for number, setting in enumerate(tried, start=1):
        log.info("%s: setting %d of %d, %s", name, number, len(tried), setting.labels["setting"])
        positions, *found = setting.errors(truth)
        errors = [np.inf] * 2 if positions is None else [np.nan if e is None else e for e in found]
        rows.append(dict(zip(("position_error", "deformation_error"), errors, strict=True)))
    log.info("%s: timing %d settings in turn, over %d frames", name, len(tried), frames)
    order = np.random.default_rng(0).permutation(len(tried))
    wall, used = perf_counter(), process_time()
    times = measure([tried[i].variant({}, frames) for i in order], WARMUP, REPEATS)
    busy = perf_counter() - wall > BUSY * (process_time() - used)
    for i, time in zip(order, times, strict=True):
        rows[i] = {**tried[i].labels, **rows[i], "ms": time["ms_per_frame"]}
    table = pd.DataFrame(rows).astype({"iterations": "Int64"})
    error = table.position_error.fillna(0.0)  # nothing moves: every setting is exact
    best = settings.pareto(error.tolist(), table.ms.tolist())
    table = table.assign(best=np.array(best) & np.isfinite(error)).sort_values("ms")
    table.attrs = {
        "frames": frames, "busy": busy,
        "mesh_error": _mesh_error(meshes, reference, progress),
    }  # fmt: skip
    return table.reset_index(drop=True)


def _items(given: Any, name: str) -> list[Any]:
    if isinstance(given, (list, tuple)):
        return list(given)
    raise ConfigurationError(f"{name} = {shown(given, 60)}: a list is required")


def _coarser(scene: Scene, given: Any) -> Coarser:
    """Return ``scene`` on the mesh ``given``, or in this file, read as the scene's own file is."""
    if isinstance(given, Mesh):
        return on_mesh(scene, given)
    path, own = files.file_path(given), scene.config.mesh
    like = own if isinstance(own, MeshFile) else MeshFile(kind="file", path="any")
    config = like.model_copy(update={"path": path.name})
    try:
        return on_mesh(scene, config.build(path.parent))
    except PdromError as error:
        fault = str(error).removeprefix(f"{path}: ").removeprefix(f"{path.name}: ")
        raise ConfigurationError(f"{path}: {fault}") from error


def _full_order(scene: Scene, meshes: Sequence[Coarser]) -> Iterator[Setting]:
    config = scene.config
    counts = dict.fromkeys((*COUNTS, (config.iterations, config.anderson_window)))
    coarse = settings.full_order(scene, ON_COARSER, meshes)
    for setting in (*settings.full_order(scene, counts), *coarse):
        labels, plain = setting.labels, (settings.PLAIN, settings.COARSER)
        words = f"{labels['iterations']} iteration{'s' * (labels['iterations'] > 1)}"
        words += ", Anderson" * (labels["method"] not in plain)
        if labels["vertices"] < scene.mesh.vertices:
            words += f" on {labels['vertices']:,} vertices"
        yield replace(setting, labels={"setting": words, **labels})


def _of_model(scene: Scene, given: Any, number: int) -> Iterator[Setting]:
    """Yield settings of a model or its file; one that cannot run ``scene`` raises an error."""
    name = str(number) if isinstance(given, Model) else files.file_path(given).name
    model = given if isinstance(given, Model) else load_model(given)
    labels = {"method": MODEL, "iterations": ITERATIONS, "vertices": scene.mesh.vertices}
    labels = {"setting": f"model {name}, {ITERATIONS} iterations", **labels}
    loop = model.loop(scene.iterated(ITERATIONS), solver="local_global")
    if not isinstance(model.reduced, SubspaceModel):
        yield Setting(labels, *loop)
        return
    yield settings.reduced(labels, scene, model.reduced, ITERATIONS)
    labels = labels | {"setting": f"model {name}, converged", "iterations": None}
    with suppress(NotReducibleError):  # Newton's method needs derivatives of every group
        yield settings.reduced(labels, scene, model.reduced, None)


def _mesh_error(
    meshes: Sequence[Coarser], reference: np.ndarray, progress: Progress
) -> float | None:
    """Estimate the relative error of the scene's mesh by two of the coarser ``meshes``."""
    ends, runs = [meshes[0], meshes[-1]] if len(meshes) > 1 else [], []
    for mesh in ends:
        found = converged_positions(mesh.scene, partial(_on, progress, mesh.scene.mesh.vertices))
        if found is None:
            return None
        runs.append(np.stack([mesh.positions(y) for y in found]))
    return error_of_mesh(reference, ends, runs)


def _on(progress: Progress, vertices: int, name: str, frames: int) -> OnFrame:
    return progress(f"{name} on {vertices:,} vertices", frames)
