"""A run of a hyper-reduced model, compared with the full-order run frame by frame."""

import numpy as np

from pdrom.model.scene import Scene
from pdrom.reduction.local.rerun import Rerun
from pdrom.reduction.subspace.model import SubspaceModel


def rerun_model(
    scene: Scene, model: SubspaceModel, reference: np.ndarray, blowup_extent: float
) -> tuple[Rerun, np.ndarray]:
    """Outcome and coordinates (F' + 1, K, 3) of a run; a blow-up ends it and is recorded.

    Parameters
    ----------
    reference, blowup_extent : see `pdrom.reduction.local.rerun.rerun`
    """
    loop, state = model.loop(scene)
    coordinates, positions = [state.positions], [model.positions(state.positions)]
    difference, extents, blowup = [], [], None
    for frame in range(scene.config.frames):
        with np.errstate(over="ignore", invalid="ignore"):
            state, _ = loop.step(state, frame)
            q = model.positions(state.positions)
        if not np.isfinite(q).all():
            blowup = frame
            break
        coordinates.append(state.positions)
        positions.append(q)
        difference.append(float(np.linalg.norm(q - reference[frame + 1])))
        extents.append(float(np.ptp(q, axis=0).max()) / scene.mesh.extent)
        if extents[-1] > blowup_extent:
            blowup = frame
            break
    outcome = Rerun(np.stack(positions), np.array(difference), np.array(extents), blowup)
    return outcome, np.stack(coordinates)
