"""A reduced run: the step loop of the full-order model with one group's local step replaced."""

from collections.abc import Sequence

import numpy as np

from pdrom.model.dynamics.stepper import LocalStep
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.runs.bounded import BoundedRun
from pdrom.model.scene import Scene
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.rerun import Rerun, compare
from pdrom.reduction.sampling.reduction import Reduction


def replace_group(scene: Scene, group: str, replacement: LocalStep) -> list[LocalStep]:
    """Local steps of the scene with the one of ``group`` replaced by ``replacement``."""
    scene.group(group)
    return [replacement if g.name == group else g for g in scene.groups]


def rerun(
    scene: Scene,
    system: GlobalSystem,
    local_steps: Sequence[LocalStep],
    reference: np.ndarray,
    blowup_extent: float,
    offset: np.ndarray | None = None,
) -> Rerun:
    """Run a scene with other local steps and compare it with its full-order trajectory.

    Parameters
    ----------
    reference : (F + 1, N, 3) positions of the full-order run
    blowup_extent : the run ends when the extent exceeds this multiple of the rest extent
    offset : (N, 3) m, added to the first positions
    system : factored system of the scene's global step
    local_steps : those that take the place of the scene's own
    """
    loop = scene.stepper(system, local_steps, track_objective=False)
    start, frames, unit = scene.initial_state(offset), scene.config.frames, scene.mesh.extent
    return compare(BoundedRun(loop.run, start, frames, blowup_extent, unit), reference)


def rerun_reduced(
    scene: Scene,
    group: str,
    reduction: Reduction,
    reference: np.ndarray,
    blowup_extent: float,
    system: GlobalSystem | None = None,
    offset: np.ndarray | None = None,
) -> Rerun:
    """Run a scene with the projections of a ``group`` by ``reduction``, see `rerun`.

    ``system`` is the scene's own unless another is given.
    """
    steps = replace_group(scene, group, ReducedLocalStep(scene.group(group), reduction))
    return rerun(scene, system or scene.system, steps, reference, blowup_extent, offset)
