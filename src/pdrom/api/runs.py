"""Full-order and reduced runs."""

import logging
import os
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numba.core import event

from pdrom.api import files
from pdrom.api.records import Run, stored_run
from pdrom.core import config_file
from pdrom.core.errors import ConfigurationError, SnapshotError, choices
from pdrom.core.provenance import made_by
from pdrom.core.store import open_hdf5
from pdrom.core.yamlfile import shown, validate
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import FrameReport
from pdrom.model.dynamics.system import DEFAULT_SOLVER
from pdrom.model.runs import run as run_full_order
from pdrom.model.scene import Scene
from pdrom.reduction.basis import Basis, group_basis
from pdrom.reduction.method import MethodSpec, load_methods
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.snapshots import training_frames

log = logging.getLogger(__name__)
SNAPSHOTS = 100  # largest number of training snapshots of a group if the scene sets none


class _Compilation(event.TimingListener):  # type: ignore[misc]
    """Measure how long a run ``name`` compiles kernels; log when this begins."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name

    def on_start(self, started: event.Event) -> None:
        if self._name:
            log.info("%s: compiling kernels (once, up to a minute)", self._name)
        self._name = ""
        super().on_start(started)


def run(
    scene: Scene,
    out: str | os.PathLike[str] | None = None,
    on_frame: Callable[[int, FrameReport], None] = lambda frame, report: None,
) -> Run:
    """Run a scene in full order; snapshots of every group are stored for the training of a basis.

    Log a warning where held vertices or free vertices at rest lie inside an obstacle, and (level
    INFO) the compilation of kernels, which the first run of a kind of scene waits for.

    Parameters
    ----------
    scene : scene made by `build_scene` or `load_scene`
    out : file (HDF5) to write; None writes no file
    on_frame : called after each frame with its number, from 0, and the solver's report

    Returns
    -------
    Run
        Positions and milliseconds of every frame, snapshots of every group.

    Raises
    ------
    ConfigurationError, StorageError
        ``scene`` is no scene; ``out`` cannot be written, which is checked before the run.
    """
    files.require_runnable(scene, out, on_frame)
    scene.log_holds()
    scene.log_contacts()
    count, plans = scene.config.frames, scene.config.reduce
    usual = min((count + 1) // 2, SNAPSHOTS)
    frames = {
        group: training_frames(count, plans[group].train if group in plans else usual)
        for group in scene.config.groups
    }
    config = scene.config.model_dump(mode="json")
    reported = {"scene": config, "run": "train", "solver": DEFAULT_SOLVER}
    with made_by("pdrom.api.run", reported), ExitStack() as kept:
        # without ``out``, the run is written to a temporary folder that is deleted afterwards
        folder = "" if out else kept.enter_context(TemporaryDirectory(prefix="pdrom-"))
        path = Path(out or Path(folder, "run.h5"))
        with event.install_listener("numba:compile", _Compilation(scene.config.name)) as compiled:
            run_full_order(scene, path, frames, with_mesh=True, on_frame=on_frame)
        if compiled.done:
            log.info("%s: kernels compiled in %.1f s", scene.config.name, compiled.duration)
        with open_hdf5(path) as file:
            return stored_run(scene, file)


def basis(full: Run, group: str, method: str | MethodSpec = "pod") -> Basis:
    """Basis of the projections of a constraint group, as a reduction method requires it.

    Parameters
    ----------
    full : full-order run that has the training snapshots
    group : name of a constraint group of its scene
    method : name in config/methods.yaml, or a specification; it sets how the snapshots are centred
        and weighted, and whether the axes x, y, z have coefficients in common

    Returns
    -------
    Basis
        Modes ``V`` (3 e p, rank), ``mean`` (3 e p,), all ``singular_values``, ``rank`` (number of
        modes above round-off). A vector has e elements one after another, p rows (x, y, z) each.

    Raises
    ------
    ConfigurationError, SceneError, SnapshotError
        ``full`` is no run; the method or group is unknown; snapshots are too few or not finite.
    """
    files.require_run(full, "full")
    files.require(str, group, "group", source="the name of a constraint group")
    chosen = full.scene.group(group)
    spec = method_spec(method)
    if group not in full.snapshots:
        raise SnapshotError(f"group '{group}': the run stored no snapshots of it")
    data = full.snapshots[group]
    roundoff = float(np.linalg.norm(data.roundoff))
    return group_basis(chosen, full.scene.masses, data.p, roundoff, spec)


def methods() -> dict[str, MethodSpec]:
    """Map names to the methods in config/methods.yaml, of which an installed package has a copy."""
    return load_methods(config_file("methods.yaml"))


def projections_model(
    full: Run, group: str | None, method: str | MethodSpec, r: int
) -> ProjectionModel:
    """Model in which the projections of ``group`` are reduced to r modes by ``method``.

    ``group`` None is the scene's only group. Raises the errors of `basis`, and RankError if the
    snapshots have fewer than r modes above round-off.
    """
    chosen, spec = group_of(full.scene, group), method_spec(method)
    made = basis(full, chosen.name, spec)
    return ProjectionModel(chosen.name, Reduction(made, select(made, spec, r), spec, r=r))


def group_of(scene: Scene, name: str | None) -> ConstraintGroup:
    """Group of this name, for None the only one; ConfigurationError if there are several."""
    groups = scene.config.groups
    if name is None and len(groups) > 1:
        raise ConfigurationError(f"group: one of {', '.join(groups)} is required")
    return scene.group(name or groups[0])


def method_spec(method: str | MethodSpec) -> MethodSpec:
    """Return the method of this name in config/methods.yaml, or a specification, validated."""
    if isinstance(method, MethodSpec):
        return validate(MethodSpec, dict(method), "method")
    known = methods()
    if not isinstance(method, str) or method not in known:
        named = method if isinstance(method, str) else ""
        raise ConfigurationError(f"unknown method {shown(method, 60)}{choices(named, known)}")
    return known[method]
