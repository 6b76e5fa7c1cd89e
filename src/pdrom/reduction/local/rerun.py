"""A reduced run: the step loop of the full-order model with one group's local step replaced."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdrom.model.dynamics.stepper import LocalStep
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene
from pdrom.reduction.local.guard import Guard

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Rerun:
    """Outcome of a reduced run; a run that blows up ends there and is a result like any other.

    positions : (F' + 1, N, 3) m, the initial ones first; only finite frames
    difference : (F',) || Q_red - Q_fom ||_F of each frame, m
    extent : (F',) longest side of the bounding box over the rest extent
    blowup_frame : first frame whose extent exceeds the limit or is not finite, else None
    """

    positions: np.ndarray
    difference: np.ndarray
    extent: np.ndarray
    blowup_frame: int | None

    @property
    def frames(self) -> int:
        """Number of frames that ran and stayed finite."""
        return len(self.difference)

    @property
    def max_extent(self) -> float:
        """Largest extent of the run."""
        return float(self.extent.max(initial=0.0))


def replace_group(scene: Scene, group: str, replacement: LocalStep) -> list[LocalStep]:
    """Local steps of the scene with the one of ``group`` replaced."""
    scene.group(group)
    return [replacement if g.name == group else g for g in scene.groups]


def rerun(
    scene: Scene,
    system: GlobalSystem,
    local_steps: Sequence[LocalStep],
    reference: np.ndarray,
    blowup_extent: float,
    guard: Guard | None = None,
) -> Rerun:
    """Run a scene with other local steps and compare it with its full-order trajectory.

    Parameters
    ----------
    reference : (F + 1, N, 3) positions of the full-order run
    blowup_extent : the run ends when the extent exceeds this multiple of the rest extent
    guard : watches steps among ``local_steps``, and may end the run or repeat its frames
    """
    loop = scene.stepper(system, local_steps, track_objective=guard is not None)
    state = scene.initial_state()
    positions, difference, extents = [state.positions], [], []
    blowup = None
    for frame in range(scene.config.frames):
        with np.errstate(over="ignore", invalid="ignore"):
            state, _ = guard.step(loop, state, frame) if guard else loop.step(state, frame)
            extent = float(np.ptp(state.positions, axis=0).max()) / scene.mesh.extent
        if not np.isfinite(state.positions).all():
            blowup = frame
            break
        positions.append(state.positions)
        difference.append(float(np.linalg.norm(state.positions - reference[frame + 1])))
        extents.append(extent)
        if extent > blowup_extent:
            blowup = frame
            break
        if guard is not None and guard.record.stopped:
            break
    return Rerun(np.stack(positions), np.array(difference), np.array(extents), blowup)


def displacement_norms(reference: np.ndarray) -> np.ndarray:
    """|| Q_fom - rest ||_F of each frame, (F,) m; rest is the initial state."""
    return np.linalg.norm((reference[1:] - reference[0]).reshape(len(reference) - 1, -1), axis=1)
