"""A run of a position subspace, compared with the full-order run."""

import numpy as np

from pdrom.model.runs.bounded import BoundedRun
from pdrom.model.scene import Scene
from pdrom.reduction.rerun import Rerun, compare
from pdrom.reduction.subspace.model import SubspaceModel


def rerun_model(
    scene: Scene, model: SubspaceModel, reference: np.ndarray, blowup_extent: float = np.inf
) -> Rerun:
    """Outcome of a run of ``scene`` with ``model``; a blow-up ends it and is recorded.

    Parameters
    ----------
    reference, blowup_extent : see `pdrom.reduction.local.rerun.rerun`
    """
    loop, start = model.loop(scene)
    frames, unit = scene.config.frames, scene.mesh.extent
    run = BoundedRun(loop.run, start, frames, blowup_extent, unit, model.positions)
    return compare(run, reference)
