"""Asked errors in every hard case: a promise is kept within a factor of two, the rest is said."""

import numpy as np
import pytest

from hard_cases import training
from pdrom.experiments.hard_cases.catalogue import reducible_cases
from pdrom.reduction.asked.ask import Ask
from pdrom.reduction.asked.hierarchy import AskSettings, hierarchy
from pdrom.reduction.asked.run import CheckedRun

SETTINGS = AskSettings(
    modes=(8,), tolerances=(1e-2,), iterations=(5, 20), plain=(2,), accelerated=(5, 20)
)
QUICK = ("scrambled_sheet", "bar_plane_rotation")
CASES = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
    for name in (*reducible_cases(), *reducible_cases(slow=True))
]


@pytest.mark.parametrize("name", CASES)
def test_a_promise_holds_within_a_factor_of_two(name):
    scene = training(name).scene
    own, (motion, _) = hierarchy(scene, SETTINGS)
    for error in (0.1, 0.01):
        done = CheckedRun(scene, own, Ask(error=error), SETTINGS).outcome()
        assert len(done.positions) == scene.config.frames + 1
        if done.promised:
            assert np.isfinite(done.positions).all()
            assert motion.error(done.positions, "position") <= 2.0 * error
