"""Progress of runs on stderr: on a terminal one line is rewritten, elsewhere lines are added."""

import sys
from time import monotonic
from typing import TextIO

from pdrom.model.dynamics.stepper import FrameReport

WIDTH = 24  # number of characters of the progress bar
EVERY = 0.2  # seconds between two updates of the line on a terminal


class Progress:
    """Show the number of the frame, milliseconds per frame and the estimated time left.

    If ``stream`` is no terminal, a line is added after each 10 % of the run ``name``.
    """

    def __init__(self, name: str, frames: int, stream: TextIO | None = None) -> None:
        self._name, self._frames, self._stream = name, frames, stream or sys.stderr
        self._terminal, self._shown = self._stream.isatty(), monotonic()
        self._ends = [self._shown]

    def __call__(self, frame: int, report: FrameReport) -> None:
        """Show that frame ``frame`` (0-based) has been computed, and its time from ``report``."""
        done, now = frame + 1, monotonic()
        self._ends.append(now)
        early = now - self._shown < EVERY if self._terminal else done % max(1, self._frames // 10)
        if early and done < self._frames:
            return
        # estimate the time left from the later half of the computed frames: early ones compile code
        half = done // 2
        left = (now - self._ends[half]) / (done - half) * (self._frames - done)
        full, ms = WIDTH * done // self._frames, 1e3 * float(report.seconds.sum())
        bar = "#" * full + "." * (WIDTH - full)
        text = f"frame {done} of {self._frames}, {ms:.2f} ms a frame, {left:.0f} s left"
        line, end = f"{self._name} [{bar}] {text}", "\n" * (done == self._frames)
        self._stream.write(f"\r{line:<{3 * WIDTH}}  {end}" if self._terminal else f"{line}\n")
        self._stream.flush()
        self._shown = now
