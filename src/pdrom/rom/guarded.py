"""A rerun with one group reduced, watched by a guard as the settings say."""

import numpy as np

from pdrom.fom.system import GlobalSystem
from pdrom.rom.guard import Guard, GuardRecord
from pdrom.rom.guard_settings import GuardSettings
from pdrom.rom.local_step import ReducedLocalStep
from pdrom.rom.rerun import Rerun, replace_group, rerun
from pdrom.rom.watched import WatchedLocalStep
from pdrom.sampling.reduction import Reduction
from pdrom.scene import Scene


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
