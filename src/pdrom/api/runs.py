"""Full-order and reduced runs."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import h5py
import numpy as np

from pdrom.core.errors import ConfigurationError, SnapshotError, choices
from pdrom.core.project import config_file
from pdrom.core.provenance import made_by
from pdrom.core.store import open_hdf5
from pdrom.model.dynamics.stepper import FrameReport, State
from pdrom.model.dynamics.system import DEFAULT_SOLVER
from pdrom.model.runs.bounded import Advance, BoundedRun
from pdrom.model.runs.full_order import run as run_full_order
from pdrom.model.scene import Scene
from pdrom.reduction.basis import Basis, compute_basis
from pdrom.reduction.local.guard import GuardRecord
from pdrom.reduction.local.guard_settings import GuardSettings
from pdrom.reduction.local.guarded import Trained, guarded
from pdrom.reduction.method import MethodSpec, load_methods
from pdrom.reduction.rerun import Rerun, compare, mean_motion
from pdrom.reduction.sampling import Reduction
from pdrom.reduction.sampling.select import select
from pdrom.reduction.snapshots import row_masses, training_frames
from pdrom.reduction.subspace.companion import CompanionSpec, companion_model
from pdrom.reduction.subspace.model import SubspaceModel

SNAPSHOTS = 100  # at most, of a group for which the scene names no number
# A reduced run ends when its bounding box exceeds this multiple of the mesh's.
BLOWUP_EXTENT = 100.0
UNGUARDED = GuardSettings(action="none")


@dataclass(frozen=True)
class Snapshots:
    """Projections p (n, e p, 3) of a group at the training frames, and their round-off (n,)."""

    p: np.ndarray
    roundoff: np.ndarray


@dataclass(frozen=True)
class FullRun:
    """A full-order run.

    positions : (F + 1, N, 3) m, the initial ones first
    ms : (F,) milliseconds of each frame
    snapshots : of every constraint group, for a basis
    """

    scene: Scene
    positions: np.ndarray
    ms: np.ndarray
    snapshots: dict[str, Snapshots]


@dataclass(frozen=True)
class ReducedRun:
    """A run with the projections of one group reduced, compared with its full-order run.

    gain : norm of the sampled equations' solution operator; 1 if every projection is evaluated
    outcome : positions (F' + 1, N, 3) m, differences, and whether it blew up
    ms : milliseconds a frame (median), those of a guard included
    seen : what the guard saw, if there was one
    """

    full: FullRun
    group: str
    method: str
    r: int
    gain: float
    outcome: Rerun
    ms: float
    seen: GuardRecord = field(default_factory=GuardRecord.unwatched)

    @property
    def error(self) -> np.ndarray:
        """Error of each frame (F',) relative to the root mean square displacement of the run."""
        return self.outcome.difference / mean_motion(self.full.positions)

    @property
    def title(self) -> str:
        """What is reduced, how and to which size."""
        return f"{self.group.replace('_', ' ')}, {self.method}, r = {self.r}"


def run(
    scene: Scene,
    out: str | os.PathLike[str] | None = None,
    on_frame: Callable[[int, FrameReport], None] = lambda frame, report: None,
) -> FullRun:
    """Run a scene in full order; every group stores the snapshots that train a basis.

    Parameters
    ----------
    out : file (HDF5) to write; none without it
    on_frame : called after each frame with its number and what it did
    """
    frames = {group: _training_frames(scene, group) for group in scene.config.groups}
    config = scene.config.model_dump(mode="json")
    told = {"scene": config, "run": "train", "solver": DEFAULT_SOLVER}
    with made_by("pdrom.api.run", told), _place(out) as path:
        run_full_order(scene, path, frames, with_mesh=True, on_frame=on_frame)
        with open_hdf5(path) as file:
            return full_run(scene, file)


def full_run(scene: Scene, file: h5py.File) -> FullRun:
    """A run as it lies in a file."""
    stored = file.get("snapshots", {})
    return FullRun(
        scene,
        file["positions"][...],
        file["timings"][...].sum(axis=1),
        {name: Snapshots(s["p"][...], s["roundoff"][...]) for name, s in stored.items()},
    )


def basis(full: FullRun, group: str, method: str | MethodSpec = "pod") -> Basis:
    """Basis of a group's projections, as a method asks for it.

    Raises
    ------
    ConfigurationError, SceneError, SnapshotError
        No such method, no such group, or its snapshots are too few or not finite.
    """
    chosen, spec = full.scene.group(group), _spec(method)
    if group not in full.snapshots:
        raise SnapshotError(f"group '{group}': the run stored no snapshots of it")
    data, masses = full.snapshots[group], row_masses(chosen, full.scene.masses)
    roundoff = float(np.linalg.norm(data.roundoff))
    return compute_basis(data.p, masses, roundoff, chosen.rows_per_element, spec)


def reduce(
    full: FullRun,
    group: str,
    method: str | MethodSpec = "gappy",
    r: int = 20,
    basis_of_group: Basis | None = None,
    guard: GuardSettings = UNGUARDED,
) -> ReducedRun:
    """The scene again, with the projections of one group reduced to r modes.

    A run that blows up, or that its guard stops, ends there and is a result like any other.

    Parameters
    ----------
    guard : what watches the run, and what follows from an alarm; a companion that estimates its
        error is trained on ``full``

    Raises
    ------
    RankError
        The snapshots have fewer than r modes above round-off.
    NotReducibleError
        A companion is asked for, and the scene has an effect that no position subspace takes.
    """
    scene, spec = full.scene, _spec(method)
    made = basis_of_group or basis(full, group, spec)
    reduction = Reduction(made, select(made, spec, r), spec, r)
    trained = _trained(full, group, guard)
    advance, seen = guarded(scene, scene.system, group, reduction, guard, trained)
    seconds: list[float] = []
    start, frames, unit = scene.initial_state(), scene.config.frames, scene.mesh.extent
    frame_by_frame = BoundedRun(_clocked(advance, seconds), start, frames, BLOWUP_EXTENT, unit)
    outcome = compare(frame_by_frame, full.positions, lambda: seen.stopped)
    ms = 1e3 * float(np.median(seconds))
    name = method if isinstance(method, str) else method.title
    return ReducedRun(full, group, name, r, float(reduction.gain), outcome, ms, seen)


def methods() -> dict[str, MethodSpec]:
    """The reduction methods of config/methods.yaml by name; of an installed package its own."""
    return load_methods(config_file("methods.yaml"))


def _trained(full: FullRun, group: str, guard: GuardSettings) -> Trained:
    """What the guard knows of the full-order run."""
    companion: SubspaceModel | None = None
    if guard.action != "none" and guard.alarm == "estimate":
        frames = _training_frames(full.scene, group)
        training = full.positions[1:][frames]
        companion = companion_model(full.scene, training, frames, CompanionSpec())
    return Trained.on(full.positions, companion)


def _clocked(advance: Advance, seconds: list[float]) -> Advance:
    """``advance`` that adds the time of every frame to ``seconds``."""

    def step(state: State, frame: int) -> tuple[State, FrameReport]:
        started = perf_counter()
        result = advance(state, frame)
        seconds.append(perf_counter() - started)
        return result

    return step


def _spec(method: str | MethodSpec) -> MethodSpec:
    if isinstance(method, MethodSpec):
        return method
    known = methods()
    if method not in known:
        raise ConfigurationError(f"unknown method '{method}'{choices(method, known)}")
    return known[method]


def _training_frames(scene: Scene, group: str) -> np.ndarray:
    """The frames of the scene's plan, else all even ones up to `SNAPSHOTS` of them."""
    frames, plan = scene.config.frames, scene.config.reduce.get(group)
    count = plan.train if plan else min((frames + 1) // 2, SNAPSHOTS)
    return training_frames(frames, count)


@contextmanager
def _place(out: str | os.PathLike[str] | None) -> Iterator[Path]:
    """Where a run is written; a file that nobody asked for goes away."""
    if out is not None:
        yield Path(out)
        return
    with TemporaryDirectory(prefix="pdrom-") as folder:
        yield Path(folder) / "run.h5"
