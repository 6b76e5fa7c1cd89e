"""The alarm that the estimated error of a run is too large: its distance to an auxiliary
model, the auxiliary model."""

import numpy as np

from pdrom.model.dynamics.stepper import FrameReport, State
from pdrom.model.scene import Scene
from pdrom.reduction.local.alarm import Alarm
from pdrom.reduction.subspace.companion import RunningEstimate, companion_frames
from pdrom.reduction.subspace.model import SubspaceModel


class EstimateAlarm(Alarm):
    """Runs an auxiliary model beside a run, a frame for each of its frames.

    An alarm is given where the estimate over the frames so far exceeds ``threshold``, and where the
    auxiliary model itself blew up, so that nothing vouches for the run any more.

    Parameters
    ----------
    motion : of the training run, see `RunningEstimate`
    """

    def __init__(
        self,
        scene: Scene,
        group: str,
        companion: SubspaceModel,
        motion: float,
        threshold: float,
    ) -> None:
        # a scene of its own: holds and pokes remember where a run had their vertices
        own = Scene.build(scene.config, scene.mesh, masses=scene.masses)
        self._frames = companion_frames(own, companion)
        next(self._frames)
        self._current: np.ndarray | None = None
        self._running = RunningEstimate(motion)
        self._group, self._threshold = group, threshold

    def raised(self, state: State, report: FrameReport) -> tuple[str, str] | None:
        self._current = next(self._frames, None)
        if not np.isfinite(state.positions.sum()):
            return self._group, "not finite"
        if self._current is None:
            return self._group, "companion"
        estimate = self._running.after(state.positions, self._current)
        return None if estimate <= self._threshold else (self._group, "estimate")

    def accept(self, state: State) -> None:
        if self._current is not None:
            self._running.add(state.positions, self._current)

    @property
    def estimate(self) -> float | None:
        return self._running.value
