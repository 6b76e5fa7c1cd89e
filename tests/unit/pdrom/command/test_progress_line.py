"""The line of a run's progress."""

import io

import numpy as np

from pdrom.command.progress import Progress
from pdrom.model.dynamics.stepper import FrameReport

REPORT = FrameReport(np.zeros(0), np.array([0.0, 1e-3, 1e-3, 0.0]))


def test_progress_is_a_line_each_tenth_where_nobody_watches():
    stream = io.StringIO()
    told = Progress("small", 40, stream)
    for frame in range(40):
        told(frame, REPORT)
    lines = stream.getvalue().splitlines()
    assert len(lines) == 10
    assert lines[4].startswith(f"small [{'#' * 12}{'.' * 12}] frame 20 of 40, 2.00 ms a frame, ")
    assert "frame 40 of 40, 2.00 ms a frame, 0 s left" in lines[-1]


def test_progress_on_a_terminal_is_one_line_that_is_written_again(monkeypatch):
    """A fifth of a second apart; the frame that may compile kernels is no measure of the others."""
    stream = io.StringIO()
    stream.isatty = lambda: True
    times = iter([0.0, 50.0, *(50.0 + 0.125 * frame for frame in range(1, 10))])
    monkeypatch.setattr("pdrom.command.progress.monotonic", lambda: next(times))
    told = Progress("small", 10, stream)
    for frame in range(10):
        told(frame, REPORT)
    shown = stream.getvalue()
    assert shown.endswith("  \n")
    assert shown.count("\n") == 1
    frames = [text.split("frame ")[1].split(" of ")[0] for text in shown.split("\r")[1:]]
    assert frames == ["1", "3", "5", "7", "9", "10"]
    assert "frame 5 of 10, 2.00 ms a frame, 1 s left" in shown
