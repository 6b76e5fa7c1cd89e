"""Training of reduced models: trajectories, basis, sampled elements, validation."""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.api import files
from pdrom.api.model import Model, OnFrame, Training, require_same_mesh, silent, worst_errors
from pdrom.api.records import FULL, Run, standstill
from pdrom.api.runs import group_of, method_spec, projections_model, run
from pdrom.core.errors import ConfigurationError, NotReducibleError, SnapshotError, SolverError
from pdrom.core.store import require_finite
from pdrom.core.yamlfile import ConfigModel, keys_of, shown
from pdrom.core.yamlfile import validate as checked
from pdrom.model.mesh.selection import Selection, select_vertices
from pdrom.model.runs import converged_run
from pdrom.model.scene import Scene
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.subspace.ecsw import Choose
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.newton import CONVERGED, UNNOTICED
from pdrom.reduction.subspace.space import require_effects
from pdrom.reduction.subspace.training import make_columns, sampled_models

log = logging.getLogger(__name__)

EVALUATIONS = 20_000  # largest number of evaluations for a converged frame
ROUNDOFF = 1e-13  # of positions, relative to the mesh's extent
METHOD = "gappy"  # default method that reduces the projections of a group
SIZES = (20, 40, 80)  # numbers of modes that are tried for a required error
VALIDATION = 1_000_000  # first seed of the validation trajectories
Progress = Callable[[str, int], OnFrame]
"""Function of a step's name and number of frames; it returns the function each frame calls."""

Count = Annotated[int, Field(ge=0, le=10_000)]
Bound = Annotated[float, Field(gt=0.0, lt=1.0)]


class Arguments(ConfigModel):
    """Arguments of `train` that are numbers, names or selections."""

    modes: Count = 40
    tolerance: Bound | None = 0.01
    skinning: Count = 0
    hold: tuple[Selection, ...] = ()
    variations: Count = 0
    validate_: Annotated[Count, Field(alias="validate")] = 0
    converged: bool = True
    error: Bound | None = None
    group: str | None = None
    r: Annotated[int, Field(ge=1, le=1_000_000)] = 20


def arguments(scene: Scene, given: Mapping[str, Any]) -> Arguments:
    """Check the arguments ``given`` to `train`, by name, before any run of ``scene``.

    Raises the errors of `train`, also for an argument that has no effect because of another one.
    """
    names = keys_of(Arguments)
    plain = {key: v.item() if isinstance(v := given[key], np.generic) else v for key in names}
    asked, basis, method = checked(Arguments, plain, "train"), given.get("basis"), given["method"]
    own, usual = (a.model_dump(by_alias=True) for a in (asked, Arguments()))
    changed = {key for key in names if own[key] != usual[key]}
    changed |= {key for key in ("basis", "selection") if given.get(key) is not None}
    changed |= {"others"} if given["others"] else set()
    local = method is not None or asked.group is not None
    _ = scene.config.count  # a model has a number of iterations
    apart = {
        "with group or method": (local, changed - {"group", "r", "validate"}),
        "without group or method": (not local, changed & {"r"}),
        "with error, which tries 20, 40 and 80 modes": (bool(asked.error), changed & {"modes"}),
        "with basis": (basis is not None, changed & {"modes", "error"}),
        "with tolerance None": (asked.tolerance is None, changed & {"selection"}),
    }
    for what, (applies, wrong) in apart.items():
        if applies and wrong:
            raise ConfigurationError(f"train: omit {', '.join(sorted(wrong))}: no effect {what}")
    if asked.error is not None and not asked.validate_:
        raise ConfigurationError("train: error requires validate (validation trajectories) >= 1")
    for name in ("selection", "progress"):
        if (function := given.get(name)) is not None and not callable(function):
            raise ConfigurationError(f"train: {name} = {shown(function, 60)}: not a function")
    if local:
        group_of(scene, asked.group)
        method_spec(method or METHOD)
    else:
        require_effects(scene)
    for one in asked.hold:
        select_vertices(scene.mesh, one)
    return asked


def train(
    full: Run,
    *others: Run,
    modes: int = 40,
    tolerance: float | None = 0.01,
    skinning: int = 0,
    basis: np.ndarray | None = None,
    selection: Choose | None = None,
    hold: Sequence[Any] = (),
    variations: int = 0,
    validate: int = 0,
    converged: bool = True,
    error: float | None = None,
    group: str | None = None,
    method: str | MethodSpec | None = None,
    r: int = 20,
    progress: Progress = lambda name, frames: silent,
) -> Model:
    """Train a reduced model of a mesh on one or more runs.

    full : full-order run
    others : further runs on the same mesh, with the same constraint groups
    modes : number of POD modes of the displacements
    tolerance : bound of the relative residual of the training equations with sampled elements; None
        keeps all elements
    skinning : number of skinning columns in addition to the modes
    basis : columns (N, K) instead of modes; affine columns are added, dependent columns dropped
    selection : function in place of non-negative least squares: of equations G (m, elements), sums
        b (m,) and tolerance, it returns indices and factors x >= 0 with G x near b
    hold : sides or other selections of vertices that later scenes may hold, in addition to those
        of the training scenes
    variations : number of random variations of the first scene for training
    validate : number of other random variations for validation
    converged : solve the training scenes again until every frame has converged
    error : return the smallest of the models of 20, 40 and 80 modes whose errors of positions and
        deformation are at most this on all validation trajectories (``validate`` of at least 1)
    group : reduce the projections of this group instead; if None, ``method`` takes the only group
    method : name in config/methods.yaml, or a specification, of the method that reduces them
    r : number of modes of these projections
    progress : called with name and number of frames of each long step; returns a function that is
        called after each of its frames

    Raises PdromError for an invalid argument, runs of different meshes, too few modes or snapshots;
    NotReducibleError if no model stays within ``error``, or a training scene does not move or has
    an effect that no position subspace can simulate; SolverError if it does not converge.
    """
    started = perf_counter()
    given, runs = locals(), [_full_order(one) for one in (full, *others)]
    asked = arguments(full.scene, given)
    drawn = _variations(full.scene, "validation", asked.validate_, VALIDATION)
    if method is not None or asked.group is not None:
        reduced = projections_model(full, asked.group, method or METHOD, asked.r)
        done = Training((full.scene.config.name,), False, None, None, perf_counter() - started)
        tests = [_reference(scene, False, progress) for scene in drawn]
        return _validated(Model(full.scene, reduced, done, pd.DataFrame()), [full], tests)
    for one in runs:
        require_same_mesh(full.scene, one.scene)
        require_effects(one.scene)
    hold = [select_vertices(full.scene.mesh, one) for one in asked.hold]
    more = _variations(full.scene, "variation", asked.variations, 1)
    own = _own_columns(full.scene, basis)
    references = [
        converged_reference(one.scene, progress) if asked.converged else one for one in runs
    ]
    references += [_reference(scene, asked.converged, progress) for scene in more]
    spent = perf_counter() - started
    tests = [_reference(scene, asked.converged, progress) for scene in drawn]
    tried: list[tuple[float, str]] = []
    for size in (asked.modes,) if asked.error is None else SIZES:
        model = _trained(references, asked, size, hold, own, selection, spent)
        spent, model = model.training.seconds, _validated(model, references, tests)
        if asked.error is None:
            return model
        position, deformation = worst_errors(model.validation[len(references) :])
        worst = float(np.nanmax([position, deformation, 0.0]))  # nan of a body that is rigid
        if worst <= asked.error:
            return model
        reached = f"{position:.2g} (positions) and {deformation:.2g} (deformation; inf: blew up)"
        tried.append((worst, f"{size} modes, with errors {reached}"))
    fault = f"every model exceeds error = {asked.error:g}; the best has {min(tried)[1]}"
    raise NotReducibleError(f"scene '{full.scene.config.name}': {fault}")


def _full_order(run: Any) -> Run:
    """Return ``run`` if it is a full-order run that did not blow up."""
    files.require_run(run, "full")
    if not run.full_order or run.blowup_frame is not None:
        ended = "" if run.blowup_frame is None else f", which blew up in frame {run.blowup_frame}"
        raise ConfigurationError(f"{run.title}{ended}: training needs complete full-order runs")
    return run


def _trained(
    references: Sequence[Run], asked: Arguments, modes: int, hold: Sequence[np.ndarray],
    own: np.ndarray | None, selection: Choose | None, before: float,
) -> Model:  # fmt: skip
    """Train a model with ``modes`` modes, or ``own`` columns (N, K), without validation.

    ``before`` is the time of training so far, s.
    """
    if all(still := [standstill(run.scene, run.positions) for run in references]):
        raise NotReducibleError(f"scene '{references[0].scene.config.name}': {still[0]}")
    started, scenes = perf_counter(), [run.scene for run in references]
    frames = np.concatenate([run.positions[1 :: len(references)] for run in references])
    columns = make_columns(scenes, frames, modes, asked.skinning, own, hold)
    reduced, count = SubspaceModel(columns), modes + asked.skinning
    if own is None and columns.modes < count:
        log.warning("%d modes are requested, but only %d exist", count, columns.modes)
    if asked.tolerance is not None:
        log.info("selecting elements for a subspace of %d columns", columns.B.shape[1])
        longest = max(scene.config.frames for scene in scenes)
        all_frames, bounds = np.arange(longest), [asked.tolerance]
        (reduced,) = sampled_models(scenes, columns, all_frames, bounds, choose=selection)
        used = reduced.elements_evaluated(scenes[0])
        log.info("%d elements selected in %.1f s", used, perf_counter() - started)
    names, seconds = tuple(one.config.name for one in scenes), before + perf_counter() - started
    compiled = all(group.gradient_kernel for group in scenes[0].groups)
    solver = "newton" if asked.converged and compiled else "local_global"
    done = Training(names, asked.converged, asked.tolerance, reduced.residual, seconds, solver)
    return Model(scenes[0], reduced, done, pd.DataFrame())


def _own_columns(scene: Scene, basis: Any) -> np.ndarray | None:
    """Return ``basis`` (N, K) as finite floats, scaled to 1, or None; SnapshotError if invalid."""
    if basis is None:
        return None
    try:
        found = np.asarray(basis)
    except ValueError:
        found = np.empty(0, object)
    if found.dtype.kind not in "fiu" or found.ndim != 2 or len(found) != scene.mesh.vertices:
        required = f"({scene.mesh.vertices}, K) numbers, a column for each basis vector"
        raise SnapshotError(f"basis: {found.dtype} {found.shape}, required: {required}")
    found = require_finite("basis", found.astype(float), SnapshotError)
    largest = np.abs(found).max(axis=0, initial=0.0)
    return found / np.where(largest > 0.0, largest, 1.0)


def _variations(scene: Scene, kind: str, count: int, seed: int) -> list[Scene]:
    """Build ``count`` variations of ``scene`` with seeds from ``seed`` on, named by ``kind``."""
    names = [f"{scene.config.name}_{kind}_{n + 1}" for n in range(count)]
    drawn = [scene.config.training_variant(seed + n) for n in range(count)]
    configs = [c.model_copy(update={"name": name}) for c, name in zip(drawn, names, strict=True)]
    return [Scene.build(config, scene.mesh, scene.masses) for config in configs]


def tolerance_of(scene: Scene) -> float:
    """Return the step, relative to the mesh's extent, below which a frame is converged."""
    own = UNNOTICED * scene.config.time_step**2 / scene.mesh.extent
    return min(CONVERGED, max(own, ROUNDOFF))


def _reference(scene: Scene, converged: bool, progress: Progress) -> Run:
    if converged:
        return converged_reference(scene, progress)
    return run(scene, on_frame=progress(scene.config.name, scene.config.frames))


def converged_reference(scene: Scene, progress: Progress) -> Run:
    """Simulate ``scene`` with converged full-order frames; SolverError if one does not converge."""
    name, frames = scene.config.name, scene.config.frames
    started = perf_counter()
    log.info("%s: solving every frame to convergence", name)
    tick = progress(f"{name}, converged", frames)
    found = converged_run(scene, tolerance_of(scene), EVALUATIONS, tick)
    if found is None:
        raise SolverError(
            f"scene '{name}': a frame does not converge in {EVALUATIONS} evaluations; use a "
            "smaller time_step or weights, or converged=False (--unconverged) to train without"
        )
    ms = np.full(frames, 1e3 * (perf_counter() - started) / frames)
    log.info("%s: converged in %.1f s", name, 1e-3 * ms.sum())
    return Run(scene, found, ms, method=f"{FULL}, converged")


def _validated(model: Model, training: Sequence[Run], tests: Sequence[Run]) -> Model:
    rows = []
    for reference in (*training, *tests):
        log.info("%s: comparing with the full-order model", reference.scene.config.name)
        made = model.run(reference.scene)
        errors = made.error(reference)
        steps = reference.scene.config.time_step / training[0].scene.config.time_step
        at = np.round(steps * np.arange(len(reference.positions))).astype(np.int64)
        shown = training[0].positions[np.minimum(at, len(training[0].positions) - 1)]
        replayed = replace(reference, positions=shown).error(reference)
        speed = model.speed(reference.scene)
        rows.append({
            "trajectory": reference.scene.config.name, "position_error": errors.position,
            "deformation_error": errors.deformation, "replay_error": replayed.position,
            "ms": speed["ms"], "speedup": speed["speedup"], "busy": speed["busy"],
            "blowup_frame": made.blowup_frame,
        })  # fmt: skip
    numbers = dict.fromkeys(set(rows[0]) - {"trajectory", "busy"}, float)
    return replace(model, validation=pd.DataFrame(rows).astype(numbers))
