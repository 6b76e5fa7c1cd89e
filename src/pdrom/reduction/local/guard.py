"""A guard at run time: a reduced run notices that it leaves what its basis was trained on.

It watches, frame by frame: whether positions are finite, the coefficients against those of the
training snapshots, the bounding box against that of the training run, and the objective, which
projective dynamics never raises within a frame (Bouaziz et al. 2014, section 3).
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pdrom.model.dynamics.stepper import FrameReport, State, Stepper
from pdrom.reduction.local.guard_settings import GuardSettings
from pdrom.reduction.local.watched import WatchedLocalStep

log = logging.getLogger(__name__)

REASONS = ("not finite", "coefficients", "extent", "objective")
# Rounding errors of the terms that cancel in the energy, relative to them.
CANCELLATION = 1e-12


@dataclass
class GuardRecord:
    """What a guard saw in a run.

    frame, group, reason : of the first frame that left the trained range (None: no frame did)
    count : frames that left it
    fallback_frames : frames that were repeated with full projections
    stopped : whether the run was ended by the guard
    watched : whether anybody watched
    """

    frame: int | None = None
    group: str | None = None
    reason: str | None = None
    count: int = 0
    fallback_frames: int = 0
    stopped: bool = False
    watched: bool = True

    @classmethod
    def unwatched(cls) -> "GuardRecord":
        """Record of a run without a guard."""
        return cls(watched=False)

    def columns(self) -> dict[str, object]:
        """Cells of the tables; counts are empty if nobody watched."""
        return {
            "guard_frame": self.frame,
            "guard_reason": self.reason,
            "guard_count": self.count if self.watched else None,
            "fallback_frames": self.fallback_frames if self.watched else None,
        }


GUARD_COLUMNS = tuple(GuardRecord().columns())


@dataclass
class Guard:
    """Watches the reduced groups of one run and acts as its settings say.

    steps : the watched local steps of the loop
    trained_extent : longest side of the bounding box over the training run, m
    """

    settings: GuardSettings
    steps: Sequence[WatchedLocalStep]
    trained_extent: float
    record: GuardRecord = field(default_factory=GuardRecord)

    def step(self, loop: Stepper, state: State, frame: int) -> tuple[State, FrameReport]:
        """Do one frame of ``loop``, which tracks its objective.

        A frame that falls back starts again from its first state: its predicted positions, held
        vertices and frame-lagged data are those of a full-order frame.
        """
        result, report = loop.step(state, frame)
        found = self._leaves(result, report)
        if found is None:
            return result, report
        self._note(frame, *found)
        if self.settings.action == "stop":
            self.record.stopped = True
        elif self.settings.action == "fall-back":
            self.record.fallback_frames += 1
            return self._full_frame(loop, state, frame)
        return result, report

    def _full_frame(self, loop: Stepper, state: State, frame: int) -> tuple[State, FrameReport]:
        for step in self.steps:
            step.full = True
        try:
            return loop.step(state, frame)
        finally:
            for step in self.steps:
                step.full = False

    def _leaves(self, state: State, report: FrameReport) -> tuple[str, str] | None:
        """(group, reason) if the frame left the trained range; "all" if it may be any group."""
        q = state.positions
        distances = [step.distance() for step in self.steps]
        # nan is farther out than anything
        worst = int(np.argmax(np.nan_to_num(distances, nan=np.inf)))
        group = self.steps[worst].name
        # one sum over all entries: it is not finite if any of them is not
        if not np.isfinite(q.sum()) or not np.isfinite(distances[worst]):
            return group, "not finite"
        if distances[worst] > self.settings.margin:
            return group, "coefficients"
        if len(self.steps) > 1:
            group = "all"
        if _extent(q) > self.settings.extent * self.trained_extent:
            return group, "extent"
        return (group, "objective") if self._rises(report.objective) else None

    def _rises(self, objective: np.ndarray) -> bool:
        known = objective[~np.isnan(objective)]
        if len(known) < 2:
            return False
        noise = CANCELLATION * sum(step.projection_energy for step in self.steps)
        return bool(known[-1] > (1.0 + self.settings.rise) * known[-2] + noise)

    def _note(self, frame: int, group: str, reason: str) -> None:
        record = self.record
        record.count += 1
        if record.frame is None:
            record.frame, record.group, record.reason = frame, group, reason
            log.warning("frame %d, group %s: leaves the trained range (%s)", frame, group, reason)


def _extent(q: np.ndarray) -> float:
    """Longest side of the bounding box of (N, 3), m; contiguous axes make it eight times faster."""
    axes = np.ascontiguousarray(q.T)
    return float((axes.max(axis=1) - axes.min(axis=1)).max())


def largest_extent(positions: np.ndarray) -> float:
    """Longest side of the bounding box over a run (F + 1, N, 3), m."""
    return float(np.ptp(positions, axis=1).max())
