"""One frame (K = 10 local/global iterations) of the full-order model, a scene a family.

Plain and with Anderson acceleration.
"""

import numpy as np
import pytest
from families import FAMILIES

from pdrom.model.dynamics.acceleration import Anderson
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene

WINDOW = 5


def plain(scene: Scene) -> Stepper:
    """Every iteration from the last one."""
    return scene.stepper(track_objective=False)


def accelerated(scene: Scene) -> Stepper:
    """The last iterates are combined."""
    space, config = scene.space(scene.system), scene.config
    acceleration = Anderson(WINDOW)
    return Stepper(space, config.time_step, config.iterations, scene.groups, False, acceleration)


LOOPS = {"plain": plain, "accelerated": accelerated}


@pytest.mark.parametrize("kind", LOOPS)
@pytest.mark.parametrize("family", FAMILIES)
def bench_frame(benchmark, family, kind):
    """Frame 0 from rest, factorised beforehand."""
    scene = FAMILIES[family]()
    loop, start = LOOPS[kind](scene), scene.initial_state()

    def frame() -> State:
        return loop.step(start, 0)[0]

    benchmark.group = f"frame {family}"
    state = benchmark(frame)
    benchmark.extra_info["ms_per_iteration"] = round(
        1e3 * benchmark.stats.stats.min / scene.config.iterations, 4
    )
    assert np.isfinite(state.positions).all()
