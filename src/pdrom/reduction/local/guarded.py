"""A rerun with one group reduced, watched by a guard as the settings say."""

import numpy as np

from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene
from pdrom.reduction.local.guard import Guard, GuardRecord
from pdrom.reduction.local.guard_settings import GuardSettings
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.rerun import replace_group, rerun
from pdrom.reduction.local.watched import WatchedLocalStep
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.sampling.reduction import Reduction


def guarded_rerun(
    scene: Scene,
    system: GlobalSystem,
    group: str,
    reduction: Reduction,
    reference: np.ndarray,
    blowup_extent: float,
    settings: GuardSettings,
    trained_extent: float,
) -> tuple[Rerun, GuardRecord]:
    """Rerun of ``scene`` with ``group`` reduced, and what the guard saw.

    Parameters
    ----------
    reference, blowup_extent : see `rerun`
    trained_extent : see `Guard`
    """
    chosen = scene.group(group)
    if settings.action == "none":
        steps = replace_group(scene, group, ReducedLocalStep(chosen, reduction))
        return rerun(scene, system, steps, reference, blowup_extent), GuardRecord.unwatched()
    watched = WatchedLocalStep(chosen, reduction, scene.config.iterations)
    guard = Guard(settings, [watched], trained_extent)
    steps = replace_group(scene, group, watched)
    return rerun(scene, system, steps, reference, blowup_extent, guard), guard.record
