"""Runs within a requested tolerance."""

from time import perf_counter

import numpy as np

from pdrom.api.arguments import require
from pdrom.api.records import AskedRun, FullRun
from pdrom.model.scene import Scene
from pdrom.reduction.requested.calibration import (
    Request,
    ToleranceSettings,
    calibrate,
    transferred,
)  # fmt: skip
from pdrom.reduction.requested.levels import OnWork, silent
from pdrom.reduction.requested.run import RequestedRun


def requested_run(
    full: FullRun, request: Request, scene: Scene | None, on_work: OnWork = silent
) -> AskedRun:
    """Calibrate on the motion of ``full``, then run ``scene`` (that motion without it).

    The calibration has the material, the masses, the step and the frames of ``scene``.

    Raises
    ------
    ConfigurationError
        ``scene`` is none, or has another mesh or other constraint groups.
    """
    if scene is None:
        scene = full.scene
    require(Scene, scene, "scene", source="load_scene makes one")
    training = transferred(full.scene, scene)
    started = perf_counter()
    calibration = calibrate(training, ToleranceSettings(), request.error, on_work)
    offline = perf_counter() - started
    outcome = RequestedRun(scene, calibration, request, on_work).outcome()
    frames = len(outcome.positions) - 1
    ms = np.full(frames, 1e3 * outcome.seconds / frames)
    error = None
    if scene.config.effects == training.config.effects and outcome.frames:
        errors = calibration.motions[0].errors(outcome.positions, request.quantity)
        error = float(errors[outcome.frames - 1])
    return AskedRun(scene, request, outcome, ms, offline, error)
