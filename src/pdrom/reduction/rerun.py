"""Run of a reduced model, compared with the full-order run frame by frame."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pdrom.core.packed import brief
from pdrom.model.dynamics.stepper import FrameReport, State, Stepper
from pdrom.model.runs import BoundedRun
from pdrom.model.scene import Scene


@dataclass(frozen=True)
class Rerun:
    """Result of a reduced run; a run that blows up ends in the frame `blowup_frame`."""

    positions: np.ndarray  # (F' + 1, N, 3) m of the initial state and of F' finite frames
    difference: np.ndarray  # (F',) m, || Q_red - Q_fom ||_F of the positions in each frame
    extent: np.ndarray  # (F',) longest side of the bounding box, divided by that of the rest shape
    blowup_frame: int | None  # first frame beyond `BoundedRun.limit` or not finite, else None
    coordinates: np.ndarray  # (F' + 1, K, 3) unknowns: subspace coordinates, or positions
    ms: np.ndarray  # (F',) milliseconds of each frame, with the positions of all vertices

    __repr__ = brief

    @property
    def frames(self) -> int:
        """Number of frames that ran and stayed finite."""
        return len(self.extent)

    @property
    def finite(self) -> bool:
        """Whether the run did not blow up."""
        return self.blowup_frame is None

    @property
    def max_extent(self) -> float:
        """Longest side of any frame's bounding box, divided by that at rest; 0 without frames."""
        return float(self.extent.max(initial=0.0))


def rerun(
    scene: Scene,
    loop: Stepper,
    start: State,
    reference: np.ndarray | None,
    limit: float,
    positions: Callable[[np.ndarray], np.ndarray] = lambda y: y,
    on_frame: Callable[[int, FrameReport], None] = lambda frame, report: None,
) -> Rerun:
    """Run ``loop`` from ``start``; compare it with the full-order run ``reference`` of ``scene``.

    reference : (F + 1, N, 3) m; None compares with nothing
    limit : the run ends if its bounding box exceeds this multiple of that at rest
    positions : function that maps the unknowns of ``loop`` to vertex positions (N, 3) m
    on_frame : called after each frame with its number, from 0, and the solver's report
    """
    frames, unit = scene.config.frames, scene.mesh.extent
    run = BoundedRun(loop.run, start, frames, limit, unit, positions)
    unknowns, reached, extents, ms = [start.positions], [positions(start.positions)], [], []
    for frame in run:
        unknowns.append(frame.state.positions)
        reached.append(frame.positions)
        extents.append(frame.extent)
        ms.append(1e3 * frame.seconds)
        on_frame(frame.number, frame.report)
    pairs = [] if reference is None else zip(reached[1:], reference[1:], strict=False)
    difference = np.array([float(np.linalg.norm(q - p)) for q, p in pairs])
    stacked = np.stack(reached)
    coordinates = stacked if reached[0] is unknowns[0] else np.stack(unknowns)
    ended = run.blowup_frame
    return Rerun(stacked, difference, np.array(extents), ended, coordinates, np.array(ms))


def displacement_norms(reference: np.ndarray) -> np.ndarray:
    """Compute norms (F,) m of the displacements from ``reference[0]`` in the frames after it."""
    return np.linalg.norm((reference[1:] - reference[0]).reshape(len(reference) - 1, -1), axis=1)


def step_norms(positions: np.ndarray) -> np.ndarray:
    """Compute norms (F,) m of the steps between frames of ``positions`` (F + 1, N, 3) m.

    They equal the time step times norms of velocities. Differences of two runs may be given, too.
    """
    return np.linalg.norm(np.diff(positions, axis=0), axis=(1, 2))


def mean_motion(reference: np.ndarray) -> float:
    """Compute the root mean square, m, of displacement norms of ``reference`` (F + 1, N, 3)."""
    return float(np.sqrt(np.mean(displacement_norms(reference) ** 2)))
