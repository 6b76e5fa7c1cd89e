"""The alarm that a reduced run leaves what its basis was trained on.

It compares, frame by frame: whether positions are finite, the coefficients with those of the
training snapshots, the bounding box with that of the training run, and the objective, which
projective dynamics never raises within a frame (Bouaziz et al. 2014, section 3), with its value in
the middle of the frame's iterations.
"""

from collections.abc import Sequence

import numpy as np

from pdrom.model.dynamics.stepper import FrameReport, State
from pdrom.reduction.local.alarm import Alarm
from pdrom.reduction.local.guard_settings import GuardSettings
from pdrom.reduction.local.watched import WatchedLocalStep

# Rounding errors of the terms that cancel in the energy, relative to them.
CANCELLATION = 1e-12


class TrainedRange(Alarm):
    """Limits of the trained range, from the settings.

    Parameters
    ----------
    steps : the watched local steps of the run's loop, which tracks its objective
    extent : longest side of the bounding box over the training run, m
    """

    def __init__(
        self, settings: GuardSettings, steps: Sequence[WatchedLocalStep], extent: float
    ) -> None:
        self._settings, self._steps, self._trained_extent = settings, steps, extent

    def raised(self, state: State, report: FrameReport) -> tuple[str, str] | None:
        q = state.positions
        distances = [step.distance() for step in self._steps]
        # nan is farther out than anything
        worst = int(np.argmax(np.nan_to_num(distances, nan=np.inf)))
        group = self._steps[worst].name
        # one sum over all entries: it is not finite if any of them is not
        if not np.isfinite(q.sum()) or not np.isfinite(distances[worst]):
            return group, "not finite"
        if distances[worst] > self._settings.margin:
            return group, "coefficients"
        if len(self._steps) > 1:
            group = "all"
        if _extent(q) > self._settings.extent * self._trained_extent:
            return group, "extent"
        return (group, "objective") if self._rises(report.objective) else None

    def accept(self, state: State) -> None:
        """Do nothing with ``state``: every frame is looked at for itself."""

    @property
    def estimate(self) -> None:
        return None

    def _rises(self, objective: np.ndarray) -> bool:
        known = objective[~np.isnan(objective)]
        if len(known) < 2:
            return False
        noise = CANCELLATION * sum(step.projection_energy for step in self._steps)
        return bool(known[-1] > (1.0 + self._settings.rise) * known[-2] + noise)


def _extent(q: np.ndarray) -> float:
    """Longest side of the bounding box of (N, 3), m; contiguous axes make it eight times faster."""
    axes = np.ascontiguousarray(q.T)
    return float((axes.max(axis=1) - axes.min(axis=1)).max())


def largest_extent(positions: np.ndarray) -> float:
    """Longest side of the bounding box over ``positions`` (F + 1, N, 3) of a run, m."""
    return float(np.ptp(positions, axis=1).max())
