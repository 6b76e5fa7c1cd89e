"""Interface of a run-time monitor: alarms of a reduced run, frame by frame."""

from abc import ABC, abstractmethod

from pdrom.model.dynamics.stepper import FrameReport, State


class Alarm(ABC):
    """Looks at the end of every frame of a run, without the full order."""

    @abstractmethod
    def raised(self, state: State, report: FrameReport) -> tuple[str, str] | None:
        """(group, reason) if the frame to ``state`` with its ``report`` triggers; "all" if any.

        Called once a frame; the frame may be repeated with full projections after it.
        """

    @abstractmethod
    def accept(self, state: State) -> None:
        """Go on from ``state``, the end of the frame that was judged or of its repetition."""

    @property
    @abstractmethod
    def estimate(self) -> float | None:
        """Estimated error of the run over its accepted frames; None if it is not estimated."""
