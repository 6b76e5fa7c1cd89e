"""A guard at run time: a reduced run is watched by an alarm, and something follows from it."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass, field

from pdrom.model.dynamics.stepper import FrameReport, State, Stepper
from pdrom.model.runs.bounded import frame_by_frame
from pdrom.reduction.local.alarm import Alarm
from pdrom.reduction.local.guard_settings import Action

log = logging.getLogger(__name__)


@dataclass
class GuardRecord:
    """Record of a guard: its alarms in a run, and what it did.

    frame, group, reason : of the first frame that gave an alarm (None: no frame did)
    count : frames that gave one
    fallback_frames : frames that were repeated with full projections
    estimate : estimated error of the run at its end, where that is the alarm
    stopped : whether the run was ended by the guard
    watched : whether anybody watched
    """

    frame: int | None = None
    group: str | None = None
    reason: str | None = None
    count: int = 0
    fallback_frames: int = 0
    estimate: float | None = None
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
            "guard_estimate": self.estimate,
        }


GUARD_COLUMNS = tuple(GuardRecord().columns())


@dataclass
class Guard:
    """Watches one run and acts on its alarms.

    loop : of the reduced run
    full : the same with full projections
    """

    action: Action
    alarm: Alarm
    loop: Stepper
    full: Stepper
    record: GuardRecord = field(default_factory=GuardRecord)

    def run(self, state: State, frames: range) -> Iterator[tuple[State, FrameReport]]:
        """Do ``frames`` from ``state`` one after the other; none before it is asked for."""
        return frame_by_frame(self.step)(state, frames)

    def step(self, state: State, frame: int) -> tuple[State, FrameReport]:
        """Do one frame.

        A frame that falls back starts again from its first state: its predicted positions, held
        vertices and frame-lagged data are those of a full-order frame.
        """
        result, report = self.loop.step(state, frame)
        found = self.alarm.raised(result, report)
        if found is not None:
            self._note(frame, *found)
            if self.action == "stop":
                self.record.stopped = True
            elif self.action == "fall-back":
                self.record.fallback_frames += 1
                result, report = self.full.step(state, frame)
        self.alarm.accept(result)
        self.record.estimate = self.alarm.estimate
        return result, report

    def _note(self, frame: int, group: str, reason: str) -> None:
        record = self.record
        record.count += 1
        if record.frame is None:
            record.frame, record.group, record.reason = frame, group, reason
            log.warning("frame %d, group %s: alarm (%s)", frame, group, reason)
