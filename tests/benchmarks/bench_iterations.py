"""One frame (K = 10 local/global iterations) of the full-order model, a scene a family."""

import numpy as np
import pytest
from families import FAMILIES

from pdrom.fom.stepper import State


@pytest.mark.parametrize("family", FAMILIES)
def bench_frame(benchmark, family):
    """Frame 0 from rest, factorised beforehand."""
    scene = FAMILIES[family]()
    loop, start = scene.stepper(track_objective=False), scene.initial_state()

    def frame() -> State:
        return loop.step(start, 0)[0]

    benchmark.group = "frame"
    state = benchmark(frame)
    benchmark.extra_info["ms_per_iteration"] = round(
        1e3 * benchmark.stats.stats.min / scene.config.iterations, 4
    )
    assert np.isfinite(state.positions).all()
