"""Progress of a run, and of what precedes it: one line on stderr, rewritten on a terminal."""

import os
import sys
from pathlib import Path
from time import monotonic
from typing import Self, TextIO

from pdrom.model.dynamics.stepper import FrameReport

WIDTH = 24
EVERY = 0.2  # seconds between two lines on a terminal


class Progress:
    """Frame, milliseconds of a frame and the time that is left.

    Where the stream is no terminal there is a line each tenth of the run.
    """

    def __init__(self, name: str, frames: int, stream: TextIO | None = None) -> None:
        self._name, self._frames = name, frames
        self._stream = stream or sys.stderr
        self._terminal = self._stream.isatty()
        self._shown = monotonic()
        self._ends = [self._shown]
        if not kernels_are_kept():
            self._stream.write(f"{name}: compiling kernels (once, up to a minute)\n")
            self._stream.flush()

    def __call__(self, frame: int, report: FrameReport) -> None:
        """Frame number ``frame``, from 0, is done."""
        done, now = frame + 1, monotonic()
        self._ends.append(now)
        if self._terminal:
            if done < self._frames and now - self._shown < EVERY:
                return
        elif done < self._frames and done % max(1, self._frames // 10):
            return
        self._shown = now
        # estimated by the later half: kernels are compiled in the first frames and between them
        half = done // 2
        left = (now - self._ends[half]) / (done - half) * (self._frames - done)
        text = line(self._name, done, self._frames, ms=1e3 * float(report.seconds.sum()), left=left)
        self._stream.write(f"\r{text}  " if self._terminal else f"{text}\n")
        if self._terminal and done == self._frames:
            self._stream.write("\n")
        self._stream.flush()


def line(name: str, done: int, frames: int, ms: float, left: float) -> str:
    """Line of a run ``name`` of which ``done`` of ``frames`` are done.

    ``ms`` are the last frame's milliseconds, ``left`` the seconds to its end.
    """
    full = WIDTH * done // frames
    bar = "#" * full + "." * (WIDTH - full)
    return f"{name} [{bar}] frame {done} of {frames}, {ms:.2f} ms a frame, {left:.0f} s left"


def kernels_are_kept() -> bool:
    """Whether the folder of compiled kernels has a step loop; True where no folder is known."""
    folder = os.environ.get("NUMBA_CACHE_DIR")
    return folder is None or any(Path(folder).glob("dynamics*/*.nbi"))


class LevelProgress:
    """Write the level of accuracy that runs and the time so far, every few seconds."""

    def __init__(self, name: str, stream: TextIO | None = None, every: float = 2.0) -> None:
        self._name, self._every, self._stream = name, every, stream or sys.stderr
        self._terminal = self._stream.isatty()
        self._began = self._shown = monotonic()

    def __enter__(self) -> Self:
        if not kernels_are_kept():
            self._stream.write(f"{self._name}: compiling kernels (once, up to a minute)\n")
        return self

    def __exit__(self, *fault: object) -> None:
        if self._terminal:
            self._stream.write("\n")

    def __call__(self, title: str) -> None:
        """Note a frame done by the level called ``title``."""
        now = monotonic()
        if now - self._shown < (EVERY if self._terminal else self._every):
            return
        self._shown = now
        text = f"{self._name}: {title}, {now - self._began:.0f} s"
        self._stream.write(f"\r{text:<{3 * WIDTH}}" if self._terminal else f"{text}\n")
        self._stream.flush()
