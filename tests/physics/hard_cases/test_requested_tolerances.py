"""Requested tolerances in every hard case: met within a factor of two, or refused."""

import numpy as np
import pytest

from hard_cases import training
from pdrom.reduction.requested.calibration import Request, ToleranceSettings, calibrate
from pdrom.reduction.requested.run import RequestedRun
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
    own = calibrate(scene, SETTINGS, 0.01)
    for error in (0.1, 0.01):
        done = RequestedRun(scene, own, Request(error=error)).outcome()
        assert len(done.positions) == scene.config.frames + 1
        if done.met:
            assert np.isfinite(done.positions).all()
            errors = own.motions[0].errors(done.positions, "position")
            assert errors[done.frames - 1] <= 2.0 * error
