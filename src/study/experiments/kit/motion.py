"""The training or the held-out motion of a scene, on which position subspaces are run."""

import numpy as np

from pdrom.model.scene import Scene
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.snapshots import training_frames
from pdrom.reduction.subspace.model import SubspaceModel, rerun_model


class Motion(Yardstick):
    """A motion of a scene with its full-order run."""

    def run(self, model: SubspaceModel, limit: float) -> Rerun:
        """Run a model; a blow-up, an extent above ``limit`` m, ends the run and is recorded."""
        return rerun_model(self.scene, model, self.reference, blowup_extent=limit)


def training_indices(scene: Scene) -> np.ndarray:
    """Training frames (n,) of ``scene``: the even ones that train the projections, too."""
    count = max(plan.train for plan in scene.config.reduce.values())
    return training_frames(scene.config.frames, count)


def training_positions(motion: Motion) -> np.ndarray:
    """Positions (n, N, 3) m of ``motion`` after the training frames."""
    return motion.reference[1:][training_indices(motion.scene)]
