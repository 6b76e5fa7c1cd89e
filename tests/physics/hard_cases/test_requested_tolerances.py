"""Requested tolerances in every hard case: met within a factor of two, or refused."""

import numpy as np
import pytest

from hard_cases import training
from pdrom.reduction.requested.run import CheckedRun, Request, ToleranceSettings, calibrate
from study.experiments.hard_cases.catalogue import reducible_cases

SETTINGS = ToleranceSettings(
    modes=(8,), tolerances=(1e-2,), iterations=(5, 20), plain=(2,), accelerated=(5, 20)
)
QUICK = ("scrambled_sheet", "bar_plane_rotation")
CASES = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
    for name in (*reducible_cases(), *reducible_cases(slow=True))
]


@pytest.mark.parametrize("name", CASES)
def test_a_tolerance_holds_within_a_factor_of_two(name):
    scene = training(name).scene
    own = calibrate(scene, SETTINGS, Request(error=0.01))
    for error in (0.1, 0.01):
        done = CheckedRun(own, scene, error).outcome()
        assert len(done.positions) == scene.config.frames + 1
        if done.met:
            assert np.isfinite(done.positions).all()
            errors = own.motions[0].errors(done.positions)
            assert errors[done.frames - 1] <= 2.0 * error
