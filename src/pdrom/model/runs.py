"""Full-order runs, written to HDF5 frame by frame, and runs that end when they blow up."""

import logging
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from time import perf_counter
from typing import Any

import h5py
import numpy as np

from pdrom.core.store import write_hdf5
from pdrom.model.compiled.rows import flat
from pdrom.model.constraints.local_kernel import PythonKernel, table_of
from pdrom.model.dynamics.acceleration import minimise
from pdrom.model.dynamics.convergence import EstimatingStepper, frame_error
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import PHASES, FrameReport, State, Stepper
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.mesh.types import store_mesh
from pdrom.model.scene import Scene

log = logging.getLogger(__name__)

# A run has blown up if its bounding box is more than this many times that of the rest shape.
BLOWUP_EXTENT = 100.0
TRIED, WINDOW, NEAR = (20, 50, 100, 200, 500, 1000, 2000), 5, 0.01  # of `remedy`
WORK = 20_000_000  # limit of evaluations times vertices in a trial of `remedy`: about 10 s


def trajectory(scene: Scene, perturbation: np.ndarray | None = None, **stepper: Any) -> np.ndarray:
    """Return positions (F + 1, N, 3) m of a run of ``scene``, the initial positions first.

    ``perturbation`` (N, 3) m is added to the first; ``stepper`` are options of `Scene.stepper`.
    """
    start = scene.initial_state(perturbation)
    return followed(scene.stepper(**stepper), start, scene.config.frames)


def followed(loop: Stepper, state: State, frames: int) -> np.ndarray:
    """Run ``loop`` from ``state`` over ``frames`` frames; return positions (F + 1, N, 3) m."""
    ends = [after.positions for after, _ in loop.run(state, range(frames))]
    return np.stack([state.positions, *ends])


class ConvergedStepper(Stepper):
    """Full-order step loop that minimises the objective of every frame up to a tolerance.

    ``changes`` and ``evaluations`` list what `minimise` returns for the frames computed so far;
    ``converged`` says whether all of these frames reached the ``tolerance``, m.
    A minimisation starts from the positions that inertia predicts or, if ``from_last``, from those
    at the beginning of the frame, which may lead to another minimum.
    """

    def __init__(
        self, scene: Scene, system: GlobalSystem, tolerance: float, limit: int,
        from_last: bool = False,
    ) -> None:  # fmt: skip
        super().__init__(scene.space(system), scene.config.time_step, limit, scene.groups)
        self.space: VertexSpace
        self._from_last = from_last
        self._kernels = [
            getattr(local, "local_kernel", None)
            or PythonKernel(local.accumulate, scene.mesh.vertices)
            for local in self.local_steps
        ]
        self._table = table_of(self._kernels)
        self.tolerance, self.converged = tolerance * scene.mesh.extent, True
        self.changes: list[float] = []
        self.evaluations: list[int] = []

    def step(
        self, state: State, frame: int, on_last_iterate: Callable[[np.ndarray], None] | None = None
    ) -> tuple[State, FrameReport]:
        """Compute ``frame`` from ``state``; ``on_last_iterate`` is ignored."""
        started = perf_counter()
        elimination: Any
        s, elimination, base, anchors = self._begin(state, frame)
        first = s
        if self._from_last:
            fixed, targets, _ = self.space.fixed(frame, state.positions, state.anchors)
            first = state.positions.copy()
            first[fixed] = targets
        system = self.space.system
        own = flat(s), flat(base), system.inertia, self._table, elimination.factor
        found = minimise(own, system.matrix, first, self.tolerance, self.iterations)
        y, change, evaluations = found
        self.converged &= change <= self.tolerance
        self.changes.append(change)
        self.evaluations.append(evaluations)
        after, seconds = self._finish(state, y, frame, anchors), np.zeros(len(PHASES))
        seconds[1] = perf_counter() - started  # the phases are not timed separately
        return after, FrameReport(np.empty(0), seconds)


def converged_run(
    scene: Scene,
    tolerance: float,
    limit: int,
    on_frame: Callable[[int, FrameReport], None] = lambda frame, report: None,
    from_last: bool = False,
) -> np.ndarray | None:
    """Return positions (F + 1, N, 3) m of a run of ``scene`` in which every frame has converged.

    Initial positions come first. The result is None if a frame does not converge: after ``limit``
    evaluations of its objective, one more iteration would change a coordinate by more than
    ``tolerance`` times the mesh's longest side. ``on_frame`` is called after each frame with its
    number and report; ``from_last``: see `ConvergedStepper`.
    """
    best = ConvergedStepper(scene, scene.system, tolerance, limit, from_last)
    state = scene.initial_state()
    ends = takewhile(lambda _: best.converged, best.run(state, range(scene.config.frames)))
    positions = [state.positions]
    for frame, (after, report) in enumerate(ends):
        positions.append(after.positions)
        on_frame(frame, report)
    return np.stack(positions) if best.converged else None


def remedy(scene: Scene, state: State, frame: int, allowed: float) -> str:
    """Describe how many accelerated iterations from ``state`` reduce the error of ``frame`` to 1 %.

    A smaller ``allowed`` error (not below 0.01 %) replaces 1 %. Large meshes have fewer trials.
    """
    start, window = state.positions, scene.config.anderson_window or WINDOW
    near, most = max(1e-4, min(NEAR, allowed)), max(TRIED[0], WORK // scene.mesh.vertices)
    log.info("%s: trying how many iterations frame %d needs", scene.config.name, frame)
    minimiser = ConvergedStepper(scene, scene.system, 1e-9, min(most, 10_000))
    best, extent = minimiser.step(state, frame)[0].positions, scene.mesh.extent
    if not minimiser.converged:
        return f"{minimiser.iterations:,} evaluations of a minimiser do not converge it"
    tried, within = [count for count in TRIED if count <= most], f"within {100 * near:.3g}%"
    for count in tried:
        loop = scene.iterated(count, window).stepper(track_objective=False)
        found = loop.step(state, frame)[0].positions
        if frame_error(found, best, start, scene.masses, extent) <= near:
            return f"iterations: {count} with anderson_window: {window} bring it {within}"
    return f"{tried[-1]:,} accelerated iterations do not bring it {within}"


def run(
    scene: Scene,
    path: str | os.PathLike[str],
    snapshot_frames: Mapping[str, np.ndarray],
    with_mesh: bool = False,
    on_frame: Callable[[int, FrameReport], None] = lambda frame, report: None,
    begun: Sequence[tuple[State, FrameReport]] = (),
    method: str | None = None,
    loop: Stepper | None = None,
) -> None:
    """Run a scene; write positions, velocities, objective, timings and the requested snapshots.

    snapshot_frames : name of a constraint group -> frames (ascending) in which its projections p in
        the last local step are stored
    with_mesh : whether the mesh is also written, so that the file can be used without the scene
    on_frame : called after each frame with its number and report
    path : HDF5 file that is written
    begun : known states and reports after the first frames, which are not computed again
    method : description of a run that does not begin at the initial state of ``scene``
    loop : step loop of the scene; errors of frames that it estimates are written, otherwise nan
    """
    frames, asked = scene.config.frames, scene.config.iterations
    tracked = asked if isinstance(asked, int) else 0  # 0: the number differs between frames
    loop, state = loop or scene.stepper(), scene.initial_state()
    with write_hdf5(path) as file:
        if with_mesh:
            store_mesh(scene.mesh, file.create_group("mesh"))
        n = scene.mesh.vertices
        shapes = {
            "positions": ((frames + 1, n, 3), "m"),
            "velocities": ((frames + 1, n, 3), "m/s"),
            "objective": ((frames, tracked), "J"),
            "timings": ((frames, len(PHASES)), "ms"),
        }
        series = {}
        for name, (shape, unit) in shapes.items():
            series[name] = file.create_dataset(name, shape, dtype="f8")
            series[name].attrs["unit"] = unit
        series["timings"].attrs["phases"] = PHASES
        recorder = _SnapshotRecorder(file, loop, snapshot_frames)
        series["positions"][0], series["velocities"][0] = state.positions, state.velocities
        for frame in range(frames):
            if frame < len(begun):
                state, report = begun[frame]
            else:
                state, report = loop.step(state, frame, recorder.observer(frame))
            series["positions"][frame + 1] = state.positions
            series["velocities"][frame + 1] = state.velocities
            series["objective"][frame] = report.objective[:tracked]
            series["timings"][frame] = 1e3 * report.seconds
            on_frame(frame, report)
            if (frame + 1) % max(1, frames // 10) == 0:
                log.info("%s: frame %d of %d", scene.config.name, frame + 1, frames)
        file.attrs["factorisations"] = scene.system.factorisations
        file.attrs.update({"method": method} if method else {})
        if isinstance(loop, EstimatingStepper):
            file["frame_error"] = [loop.errors.get(frame, np.nan) for frame in range(frames)]


class _SnapshotRecorder:
    """Writes projections p of the requested groups and frames to datasets of an HDF5 file."""

    def __init__(
        self, file: h5py.File, loop: Stepper, snapshot_frames: Mapping[str, np.ndarray]
    ) -> None:
        self._targets = []
        for name, frames in snapshot_frames.items():
            group = loop.local_step(name)
            store = file.create_group(f"snapshots/{name}")
            store["frames"] = np.asarray(frames, dtype=np.int64)
            shape = (len(frames), group.elements * group.rows_per_element, 3)
            data = store.create_dataset("p", shape, dtype="f8")
            roundoff = store.create_dataset("roundoff", (len(frames),), dtype="f8")
            store.attrs["elements"] = group.elements
            store.attrs["rows_per_element"] = group.rows_per_element
            position = {int(frame): i for i, frame in enumerate(frames)}
            self._targets.append((group, position, data, roundoff))

    def observer(self, frame: int) -> Callable[[np.ndarray], None] | None:
        """Return a function that stores p(y) of an iterate y; None in frames without snapshots."""
        wanted = [t for t in self._targets if frame in t[1]]
        if not wanted:
            return None

        def record(y: np.ndarray) -> None:
            for group, position, data, roundoff in wanted:
                data[position[frame]] = group.project(y)
                roundoff[position[frame]] = group.roundoff(y)

        return record


@dataclass(frozen=True)
class Frame:
    """State at the end of a frame in which all positions are finite.

    state : state of the step loop: positions, or coordinates in a position subspace
    positions : (N, 3) m of the vertices
    extent : longest side of the bounding box, divided by `BoundedRun.unit`
    seconds : time to compute the frame, including the positions of the vertices
    """

    number: int
    state: State
    positions: np.ndarray
    extent: float
    report: FrameReport
    seconds: float


@dataclass
class BoundedRun:
    """Iterate over the frames of a run until it blows up.

    run : iterator of states and reports after frames, as from `Stepper.run`, maybe of more frames
    limit : largest allowed ratio of the longest side of the bounding box to ``unit`` (m)
    positions : function that maps the positions in states of ``run`` to vertex positions (N, 3) m
    blowup_frame : first frame that is not finite (not yielded) or exceeds the limit, else None
    """

    run: Callable[[State, range], Iterator[tuple[State, FrameReport]]]
    state: State
    frames: int
    limit: float = np.inf
    unit: float = 1.0
    positions: Callable[[np.ndarray], np.ndarray] = lambda y: y
    blowup_frame: int | None = None

    def __iter__(self) -> Iterator[Frame]:
        states = self.run(self.state, range(self.frames))
        for number in range(self.frames):
            with np.errstate(over="ignore", invalid="ignore"):
                self.state, report = next(states)
                before = perf_counter()
                q = self.positions(self.state.positions)
                seconds = float(report.seconds.sum()) + perf_counter() - before
                # NumPy is thirty times as fast along contiguous rows of x, y and z
                extent = float(np.ptp(np.ascontiguousarray(q.T), axis=1).max()) / self.unit
            if not np.isfinite(q).all():
                self.blowup_frame = number
                return
            if extent > self.limit:
                self.blowup_frame = number
            yield Frame(number, self.state, q, extent, report, seconds)
            if self.blowup_frame is not None:
                return
