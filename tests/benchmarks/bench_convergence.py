"""Measure accuracy and cost of estimated frame errors, in alternating runs (add ``-s``)."""

import sys
from time import process_time

import numpy as np
import pytest

from frame_errors import SCENES, scene_of, share
from pdrom import api


@pytest.mark.parametrize("window", [0, 5])
def bench_frame_errors(benchmark, monkeypatch, window):
    runs = [scene_of(*each, count, window) for each in SCENES for count in (10, 30)]
    right = benchmark.pedantic(share, runs, rounds=1)
    sys.stdout.write(f"\nwindow {window}: {right:.3f} of the estimates within a factor of three\n")
    monkeypatch.setattr("pdrom.api.runs.remedy", lambda *_: "")  # once, for any number of frames
    for scene in runs[::10]:
        times = {True: [], False: []}
        for turn in range(62):
            before = process_time()
            api.run(scene, estimate=turn % 4 in (0, 3))
            times[turn % 4 in (0, 3)].append(process_time() - before)
        cost = np.median(np.divide(times[True], times[False])[1:]) - 1.0
        sys.stdout.write(f"{scene}, {scene.config.iterations} iterations: cost {cost:.1%}\n")
    assert right >= 0.9
