"""Full-order and reduced runs."""

import logging
import os
from collections.abc import Callable
from contextlib import ExitStack
from inspect import signature
from numbers import Integral
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np
from numba.core import event

from pdrom.api import files, records
from pdrom.api.records import FullRun, ReducedRun, full_run
from pdrom.core import config_file
from pdrom.core.errors import ConfigurationError, SnapshotError, choices
from pdrom.core.provenance import made_by
from pdrom.core.store import open_hdf5, require_finite, require_own, require_place
from pdrom.core.yamlfile import shown, validate
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import FrameReport, State
from pdrom.model.dynamics.system import DEFAULT_SOLVER
from pdrom.model.runs import frame_by_frame
from pdrom.model.runs import run as run_full_order
from pdrom.model.scene import GONE, Scene
from pdrom.reduction.basis import Basis, group_basis
from pdrom.reduction.method import MethodSpec, load_methods
from pdrom.reduction.rerun import rerun
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.snapshots import training_frames

log = logging.getLogger(__name__)
SNAPSHOTS = 100  # largest number of training snapshots of a group if the scene sets none
# A reduced run ends when its bounding box is larger than that of the mesh at rest by this factor.
BLOWUP_EXTENT = 100.0
GROUP = "the name of a constraint group"
FULL_RUN = "pdrom.api.run makes one, load reads one"


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
) -> FullRun:
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
    FullRun
        Positions and milliseconds of every frame, snapshots of every group.

    Raises
    ------
    ConfigurationError, StorageError
        ``scene`` is no scene; ``out`` cannot be written, which is checked before the run.
    """
    files.require(Scene, scene, "scene", source="build_scene and load_scene make one")
    try:
        signature(on_frame).bind(0, None)
    except (TypeError, ValueError) as error:
        fault = "a function of a number and a report is required"
        raise ConfigurationError(f"on_frame = {shown(on_frame, 60)}: {fault}") from error
    if out is not None:
        require_place(files.file_path(out))
        require_own(out)
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
            return full_run(scene, file)


def basis(full: FullRun, group: str, method: str | MethodSpec = "pod") -> Basis:
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
    files.require_run(FullRun, full, "full", source=FULL_RUN)
    chosen = full.scene.group(files.require(str, group, "group", source=GROUP))
    spec = _method_spec(method)
    if group not in full.snapshots:
        raise SnapshotError(f"group '{group}': the run stored no snapshots of it")
    data = full.snapshots[group]
    roundoff = float(np.linalg.norm(data.roundoff))
    return group_basis(chosen, full.scene.masses, data.p, roundoff, spec)


def methods() -> dict[str, MethodSpec]:
    """Map names to the methods in config/methods.yaml, of which an installed package has a copy."""
    return load_methods(config_file("methods.yaml"))


def reduce(
    full: FullRun,
    group: str | None = None,
    method: str | MethodSpec = "gappy",
    r: int = 20,
    basis_of_group: Basis | None = None,
    **gone: Any,
) -> ReducedRun:
    """Run the scene of ``full`` again, with the projections of one group reduced to r modes.

    A run that blows up ends there and is a result like any other.

    Parameters
    ----------
    full : run of the scene that is reduced; the result is compared with it
    group : name of the constraint group whose projections are reduced
    method : name in config/methods.yaml, or a specification
    r : number of modes, from 1 to the rank of the basis
    basis_of_group : basis of the group by `basis` for this method; None makes one from ``full``
    gone : arguments that earlier versions had, such as ``error``; they are refused

    Returns
    -------
    ReducedRun
        Has ``outcome`` (positions, differences from ``full``, frame of a blow-up), ``error`` of
        each frame, ``gain`` (amplification of errors by sampling), ``ms`` (per frame).

    Raises
    ------
    ConfigurationError, SceneError, SnapshotError
        An argument has a wrong type; the method or group is unknown; the basis belongs to another
        scene; snapshots are too few.
    RankError
        The snapshots have fewer than r modes above round-off.
    """
    if gone:
        unknown = f"reduce: no argument '{next(iter(gone))}'"
        raise ConfigurationError(f"error: {GONE}" if "error" in gone else unknown)
    files.require_run(FullRun, full, "full", source=FULL_RUN)
    group = files.require(str, group, "group", source=GROUP)
    scene, spec = full.scene, _method_spec(method)
    size: Any = r  # the range of r is checked later, when the rank of the basis is known
    if isinstance(size, bool) or not isinstance(size, Integral) or int(size).bit_length() > 63:
        raise ConfigurationError(f"r = {shown(r, 60)}: a whole number of modes is required")
    r, chosen = int(size), scene.group(group)
    if basis_of_group is None:
        made = basis(full, group, spec)
    else:
        made = _fitting_basis(basis_of_group, chosen)
    reduction = Reduction(made, select(made, spec, r), spec, r=r)
    loop, start = ProjectionModel(group, reduction).loop(scene)
    step, seconds = loop.step, list[float]()

    def clocked(state: State, frame: int) -> tuple[State, FrameReport]:
        started = perf_counter()
        result = step(state, frame)
        seconds.append(perf_counter() - started)
        return result

    outcome = rerun(scene, frame_by_frame(clocked), start, full.positions, BLOWUP_EXTENT)
    ms = 1e3 * float(np.median(seconds))
    name = method if isinstance(method, str) else method.title
    return ReducedRun(full, group, name, r, float(reduction.gain), outcome, ms)


def _method_spec(method: str | MethodSpec) -> MethodSpec:
    """Return the method of this name in config/methods.yaml, or a specification, validated."""
    if isinstance(method, MethodSpec):
        return validate(MethodSpec, dict(method), "method")
    known = methods()
    if not isinstance(method, str) or method not in known:
        named = method if isinstance(method, str) else ""
        raise ConfigurationError(f"unknown method {shown(method, 60)}{choices(named, known)}")
    return known[method]


def _fitting_basis(made: Any, group: ConstraintGroup) -> Basis:
    """Return ``made`` if it is a basis of ``group``, else ConfigurationError."""
    known = files.require(Basis, made, "basis_of_group", source="pdrom.api.basis makes one")
    records.require_types(known)
    rows, size = group.rows_per_element, 3 * group.elements * group.rows_per_element
    if (known.rows_per_element, known.mean.shape) != (rows, (size,)):
        raise ConfigurationError(
            f"basis_of_group: mean of shape {known.mean.shape}; group '{group.name}' of this scene "
            f"has {group.elements} elements with {rows} rows each: another scene's?"
        )
    if known.V.shape[-1:] != (known.rank,):
        raise ConfigurationError(f"basis_of_group: rank = {shown(known.rank, 60)} is not that of V")
    for name, values, shape in (("V", known.V, (size, known.rank)), ("mean", known.mean, (size,))):
        records.require_shapes({f"basis_of_group: {name}": (values, shape)})
        require_finite(f"basis_of_group: {name}", values, SnapshotError)
    return known
