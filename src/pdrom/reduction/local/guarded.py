"""A run with one group reduced, watched by a guard (run-time monitor)."""

from dataclasses import dataclass

import numpy as np

from pdrom.core.errors import ConfigurationError
from pdrom.model.dynamics.stepper import LocalStep, Stepper
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.runs.bounded import BoundedRun
from pdrom.model.scene import Scene
from pdrom.reduction.local.estimate_alarm import EstimateAlarm
from pdrom.reduction.local.guard import Guard, GuardRecord
from pdrom.reduction.local.guard_settings import GuardSettings
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.rerun import replace_group
from pdrom.reduction.local.trained_range import TrainedRange, largest_extent
from pdrom.reduction.local.watched import WatchedLocalStep
from pdrom.reduction.rerun import Rerun, compare, mean_motion
from pdrom.reduction.sampling.reduction import Reduction
from pdrom.reduction.subspace.model import SubspaceModel


@dataclass(frozen=True)
class Trained:
    """Facts about the training run that a guard needs.

    extent : longest side of its bounding box, m
    motion : see `pdrom.reduction.rerun.mean_motion`, m
    companion : auxiliary model trained on it; only the estimate needs one
    """

    extent: float
    motion: float
    companion: SubspaceModel | None = None

    @classmethod
    def on(cls, reference: np.ndarray, companion: SubspaceModel | None = None) -> "Trained":
        """Take them from the training run's positions ``reference``, (F + 1, N, 3) m."""
        return cls(largest_extent(reference), mean_motion(reference), companion)


def guarded(
    scene: Scene,
    system: GlobalSystem,
    group: str,
    reduction: Reduction,
    settings: GuardSettings,
    trained: Trained,
) -> tuple[Stepper | Guard, GuardRecord]:
    """Return what does the frames of a guarded run, and the guard's record.

    Parameters
    ----------
    scene, system : the run's scene and its global system
    settings : alarm and reaction

    Raises
    ------
    ConfigurationError
        The estimate is to give the alarm, and there is no auxiliary model.
    """

    def loop(step: LocalStep, watched: bool = False) -> Stepper:
        return scene.stepper(system, replace_group(scene, group, step), track_objective=watched)

    chosen = scene.group(group)
    if settings.action == "none":
        return loop(ReducedLocalStep(chosen, reduction)), GuardRecord.unwatched()
    full = scene.stepper(system, track_objective=False)
    if settings.alarm == "estimate":
        if trained.companion is None:
            raise ConfigurationError("guard.alarm = 'estimate': an auxiliary model is required")
        estimate = EstimateAlarm(
            scene, group, trained.companion, motion=trained.motion, threshold=settings.threshold
        )
        reduced = loop(ReducedLocalStep(chosen, reduction))
        guard = Guard(settings.action, estimate, reduced, full)
    else:
        watched = WatchedLocalStep(chosen, reduction, scene.config.iterations)
        leaves = TrainedRange(settings, [watched], trained.extent)
        guard = Guard(settings.action, leaves, loop(watched, watched=True), full)
    return guard, guard.record


def guarded_rerun(
    scene: Scene,
    system: GlobalSystem,
    group: str,
    reduction: Reduction,
    reference: np.ndarray,
    blowup_extent: float,
    settings: GuardSettings,
    trained: Trained,
) -> tuple[Rerun, GuardRecord]:
    """Rerun of ``scene`` with ``group`` reduced, and what the guard saw.

    Parameters
    ----------
    reference, blowup_extent : see `pdrom.reduction.local.rerun.rerun`
    settings, trained : see `guarded`
    system : factored system of the scene's global step
    """
    loop, record = guarded(
        scene, system, group, reduction=reduction, settings=settings, trained=trained
    )
    start, frames, unit = scene.initial_state(), scene.config.frames, scene.mesh.extent
    run = BoundedRun(loop.run, start, frames, blowup_extent, unit)
    return compare(run, reference, lambda: record.stopped), record
