"""A run that ends where it blows up: not finite, or larger than allowed."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from pdrom.model.dynamics.stepper import FrameReport, State

Advance = Callable[[State, int], tuple[State, FrameReport]]
Run = Callable[[State, range], Iterator[tuple[State, FrameReport]]]
"""Function of a state and frames that does them one after the other, as `Stepper.run`."""


def frame_by_frame(advance: Advance) -> Run:
    """Run that does every frame by a call of ``advance``, and none before it is asked for."""

    def run(state: State, frames: range) -> Iterator[tuple[State, FrameReport]]:
        for frame in frames:
            state, report = advance(state, frame)
            yield state, report

    return run


@dataclass(frozen=True)
class Frame:
    """End of a frame that stayed finite.

    state : in the coordinates of the step loop
    positions : (N, 3) m of the vertices
    extent : longest side of the bounding box over the run's unit
    """

    number: int
    state: State
    positions: np.ndarray
    extent: float
    report: FrameReport


@dataclass
class BoundedRun:
    """Frames of a run, in order, up to a blow-up; the frame that grew too large is the last.

    run : does the frames, perhaps some beyond a blow-up
    limit : the run ends when its extent, in multiples of ``unit`` (m), exceeds it
    positions : vertex positions of the coordinates of ``run``
    blowup_frame : first frame that is not finite or exceeds the limit; None while there is none
    """

    run: Run
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
                q = self.positions(self.state.positions)
                extent = float(np.ptp(q, axis=0).max()) / self.unit
            if not np.isfinite(q).all():
                self.blowup_frame = number
                return
            if extent > self.limit:
                self.blowup_frame = number
            yield Frame(number, self.state, q, extent, report)
            if self.blowup_frame is not None:
                return
