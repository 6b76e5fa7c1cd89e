"""The line of a run's progress."""

from io import StringIO

import numpy as np
import pytest

from pdrom.command import progress
from pdrom.model.dynamics.stepper import FrameReport

REPORT = FrameReport(np.zeros(0), np.array([0.0, 1e-3, 1e-3, 0.0]))


def test_time_left_is_that_of_the_later_frames(monkeypatch):
    """A first frame of 30 s, which compiles, and others of half a second."""
    ends = iter([0.0, *(30.0 + 0.5 * frame for frame in range(10))])
    monkeypatch.setattr(progress, "monotonic", lambda: next(ends))
    stream = StringIO()
    shown = progress.Progress("flag", 10, stream)
    for frame in range(10):
        shown(frame, REPORT)
    lines = stream.getvalue().splitlines()
    left = [float(line.split(", ")[-1].removesuffix(" s left")) for line in lines]
    assert left[0] == pytest.approx(9 * 30.0)
    assert left[1:] == pytest.approx([0.5 * frame for frame in range(8, -1, -1)], abs=0.5)
    assert "frame 10 of 10, 2.00 ms a frame" in lines[-1]
