"""Full-order runs, bases of projections, and models that reduce projections."""

import logging
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numba.core import event

from pdrom.api import files
from pdrom.api.records import FULL, STILL, Errors, Run, standstill, stored_run
from pdrom.core import config_file
from pdrom.core.errors import ConfigurationError, RankError, SnapshotError, choices
from pdrom.core.provenance import made_by
from pdrom.core.store import open_hdf5
from pdrom.core.yamlfile import shown, validate
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.convergence import Until
from pdrom.model.dynamics.stepper import PHASES, FrameReport, State, Stepper
from pdrom.model.dynamics.system import DEFAULT_SOLVER
from pdrom.model.effects.base import Anchors, held_path
from pdrom.model.runs import WINDOW, remedy, trajectory
from pdrom.model.runs import run as run_full_order
from pdrom.model.scene import Scene
from pdrom.reduction.basis import Basis, group_basis
from pdrom.reduction.method import MethodSpec, load_methods
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.snapshots import training_frames

log = logging.getLogger(__name__)
ACTING = ("iterations", "anderson_window", "vertex_mass", "masses", "effects")  # keys of a scene
SNAPSHOTS = 100  # largest number of training snapshots of a group if the scene sets none


class _Compilation(event.TimingListener):  # type: ignore[misc]
    """Measure how long a run ``name`` compiles kernels; log when compilation begins."""

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
    start: Run | None = None,
    frame: int | None = None,
    estimate: bool = True,
) -> Run:
    """Simulate a scene with the full-order model; store snapshots of every group for training.

    Log a warning if held vertices, or free vertices at rest, lie inside an obstacle, or if frames
    are not converged. Log (level INFO) the compilation of kernels, for which a first run waits.

    scene : scene made by `build_scene` or `load_scene`
    out : file (HDF5) to write; None writes no file
    on_frame : called after each frame with its number, from 0, and the solver's report
    start : run that ``scene`` continues; both have the same mesh and time step
    frame : number of frames of ``start`` that are kept (None: all). Frame numbers continue, also
        those of holds; pins that ``start`` lacks begin there, and handles at their key ``start``
    estimate : estimate the error of every 20th frame, see `pdrom.model.dynamics.convergence`

    Returns positions and milliseconds of every frame, and snapshots of every group in new frames.
    If ``start`` ran with other settings, ``method`` says so. Raises PdromError, before the run, if
    an argument is invalid: ``start`` does not fit ``scene`` or has too few frames, a handle or
    initial velocity of ``scene`` would begin before ``frame``, or ``out`` cannot be written.
    """
    files.require_runnable(scene, out, on_frame)
    begun, method = _begun(scene, start, frame)
    files.require(bool, estimate, "estimate", source="True or False")
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
    with made_by("pdrom.api.run", reported), TemporaryDirectory(prefix="pdrom-") as folder:
        path = Path(out or Path(folder, "run.h5"))
        with event.install_listener("numba:compile", _Compilation(scene.config.name)) as compiled:
            later = {group: own[own >= len(begun)] for group, own in frames.items()}
            loop = scene.stepper(estimate=estimate)
            run_full_order(scene, path, later, True, on_frame, begun, method, loop)
        if compiled.done:
            log.info("%s: kernels compiled in %.1f s", scene.config.name, compiled.duration)
        if estimate:
            _warn_unless_converged(scene, loop)
        with open_hdf5(path) as file:
            return stored_run(scene, file)


def _begun(
    scene: Scene, start: Run | None, frame: int | None
) -> tuple[list[tuple[State, FrameReport]], str | None]:
    """Return states and reports of the frames of ``start`` that are kept, and the new method."""
    if start is None:
        if frame is not None:
            raise ConfigurationError("--frame: only with --from, the run to continue (start)")
        return [], None
    own, h = files.require_run(start, "start").scene, scene.config.time_step
    for key in ("points", "triangles", "tetrahedra", "time_step"):
        had, has = (getattr(s.config if key == "time_step" else s.mesh, key) for s in (own, scene))
        if not np.array_equal(had, has):
            sizes = f"{key} ({np.shape(has) or has}) than the run ({np.shape(had) or had})"
            raise ConfigurationError(f"start: the scene has other {sizes} that it continues")
    n, frames = len(start.ms) if frame is None else frame, scene.config.frames
    last = min(len(start.ms), frames - 1)
    if not isinstance(n, (int, np.integer)) or not 1 <= n <= last:
        ends = f"the run has {len(start.ms)} frames, and the scene has frames = {frames}"
        allowed = f"allowed are 1 to {last}; {ends}" if last else f"{ends}: increase frames"
        raise ConfigurationError(f"frame = {shown(n, 60)}: {allowed}")
    q, anchors = start.positions[: n + 1].astype(float), Anchors()
    for k in range(n):
        *_, anchors = held_path(own.boundaries, range(k, k + 1), q[k], anchors)
    any_end, holds = {"until": None}, (own.boundaries, scene.boundaries)
    had, has = ([b.config.model_copy(update=any_end) for b in each] for each in holds)
    kept: list[np.ndarray | None] = []  # pins need none: they stay where they are in frame n
    for each, hold in zip(has, scene.boundaries, strict=True):
        kept.append(anchors[had.index(each)] if hold.moves and each in had else None)
        if hold.moves and kept[-1] is None and hold.active(n) and not hold.takes_hold(n):
            fault = f"effect '{hold.name}' begins before frame {n}, but the run lacks it"
            raise ConfigurationError(f"{fault}: its vertices would jump; set start: {n}")
    for first in scene.starts:
        if first.config not in [each.config for each in own.starts]:
            fault = f"effect '{first.name}' acts at frame 0 only, but the run lacks it"
            raise ConfigurationError(f"{fault}: remove it from the scene that continues the run")
    anchors, unknown, part = tuple(kept), np.full(1, np.nan), 1e-3 / len(PHASES)  # of each phase
    begun = [
        (State(after, (after - before) / h, anchors), FrameReport(unknown, np.full(4, part * ms)))
        for before, after, ms in zip(q, q[1:], start.ms, strict=False)
    ]
    same = all(getattr(own.config, key) == getattr(scene.config, key) for key in ACTING)
    return begun, None if same and start.method == FULL else f"continuing {start.title}, frame {n}"


def _warn_unless_converged(scene: Scene, loop: Stepper) -> None:
    asked, limit, after, worst = scene.config.iterations, 0.05, "", getattr(loop, "worst", None)
    if isinstance(asked, Until):
        limit, after = asked.error, f" after {asked.most} iterations (most)"
    if worst and worst[0] > limit:
        log.warning(
            "%s: frames are not converged%s: the error of frame %d is %.2g of its displacement "
            "(estimate; allowed: %g); tried on it: %s; --check estimates the error of the run",
            scene.config.name, after, worst[1], worst[0], limit,
            remedy(scene, worst[2], worst[1], limit),
        )  # fmt: skip


def check(full: Run) -> Errors:
    """Estimate the error of a run by a second run with twice the iterations, accelerated.

    It is too small if the second run is far from converged. SnapshotError if that run blows up.
    """
    scene = files.require_run(full, "full").scene
    if full.method != FULL:
        raise ConfigurationError(f"{full.title}: a full-order run is required")
    more, title = scene.config.iterations, "frame errors ten times smaller"
    if isinstance(more, Until):
        more = more.model_copy(update={"error": more.error / 10, "most": 2 * more.most})
    else:
        more, title = 2 * more, f"{2 * more} accelerated iterations a frame"
    moved = trajectory(scene.iterated(more, scene.config.anderson_window or WINDOW))
    second = Run(scene, moved, np.zeros(len(moved) - 1), method=f"{FULL}, {title}")
    return full.error(files.require_run(second, "second run"))


def basis(full: Run, group: str, method: str | MethodSpec = "pod") -> Basis:
    """Compute the POD basis of the projections of a constraint ``group`` of the run ``full``.

    ``method``, a name in config/methods.yaml or a specification, sets how the snapshots are centred
    and weighted, and whether the axes x, y, z share coefficients.

    Returns modes ``V`` (3 e p, rank), ``mean`` (3 e p,), all ``singular_values``, ``rank`` (number
    of modes above rounding errors). A vector has e elements in turn, of p rows (x, y, z) each.
    Raises PdromError if ``full`` is no run, the method or group is unknown, or snapshots are too
    few or not finite.
    """
    files.require_run(full, "full")
    files.require(str, group, "group", source="the name of a constraint group")
    chosen = full.scene.group(group)
    spec = method_spec(method)
    if group not in full.snapshots:
        raise SnapshotError(f"group '{group}': the run has no snapshots of this group")
    data = full.snapshots[group]
    roundoff = float(np.linalg.norm(data.roundoff))
    made = group_basis(chosen, full.scene.masses, data.p, roundoff, spec)
    return replace(made, origin=f"group '{group}'")


def methods() -> dict[str, MethodSpec]:
    """Map names to the methods in config/methods.yaml, of which an installed package has a copy."""
    return load_methods(config_file("methods.yaml"))


def projections_model(
    full: Run, group: str | None, method: str | MethodSpec, r: int
) -> ProjectionModel:
    """Build a model in which ``method`` reduces the projections of ``group`` to r modes.

    ``group`` None is the scene's only group. Raises the errors of `basis`, and RankError if the
    snapshots do not change, or have fewer than r modes above rounding errors.
    """
    chosen, spec = group_of(full.scene, group), method_spec(method)
    if still := standstill(full.scene, full.positions):
        raise RankError(f"scene '{full.scene.config.name}': {still}")
    made, p = basis(full, chosen.name, spec), full.snapshots[chosen.name].p
    if (changes := np.ptp(p, axis=0).max()) <= STILL * (largest := np.abs(p).max()):
        fault = f"its projections, of up to {largest:.2g}, change by at most {changes:.2g}"
        raise RankError(f"group '{chosen.name}': {fault}: there is nothing to reduce")
    return ProjectionModel(chosen.name, Reduction(made, select(made, spec, r), spec, r=r))


def group_of(scene: Scene, name: str | None) -> ConstraintGroup:
    """Return the group ``name``, or for None the only group; ConfigurationError if several."""
    groups = scene.config.groups
    if name is None and len(groups) > 1:
        raise ConfigurationError(f"group: several exist; one of {', '.join(groups)} is required")
    return scene.group(name or groups[0])


def method_spec(method: str | MethodSpec) -> MethodSpec:
    """Return the method of a name in config/methods.yaml, or a specification, validated."""
    if isinstance(method, MethodSpec):
        return validate(MethodSpec, dict(method), "method")
    known = methods()
    if not isinstance(method, str) or method not in known:
        named = method if isinstance(method, str) else ""
        raise ConfigurationError(f"unknown method {shown(method, 60)}{choices(named, known)}")
    return known[method]
