"""A run within a requested tolerance: a level is chosen, checked, and replaced if need be.

Some frames are done by a more accurate level, too, from the same state, which gives their defects.
Then a second level runs the same motion from a start moved by round-off: how far both are apart
shows how the motion amplifies errors. The tolerance counts as met for the frames over which the
estimated error, by both, is within it. A reduction that fails is replaced by the full order, a full
order by a more accurate one; at last the most accurate one runs. Nothing depends on the clock.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pdrom.model.scene import Scene
from pdrom.reduction.requested.calibration import (
    JUDGED,
    Calibrated,
    Calibration,
    Request,
    exact_level,
    last_within,
    relative_errors,
)  # fmt: skip
from pdrom.reduction.requested.levels import IN_PYTHON, Level, OnWork, Trajectory, silent

log = logging.getLogger(__name__)

CHECKS = 2  # frames of a run that are checked, at least
# A reduction is taken where it needs less than this part of the full order's work, with all that
# checks it: counted work is no closer to the time.
WORTH = 2.0 / 3.0
# A run that has grown to this multiple of the mesh has blown up, whatever a check says.
BLOWUP_EXTENT = 100.0
AMPLIFIED = "a second run, of another accuracy and moved by round-off, departs after it"


@dataclass(frozen=True)
class Outcome:
    """Run within a requested tolerance.

    positions : (F + 1, N, 3) m, the initial ones first
    frames : number of first frames for which the estimated error is within the tolerance; 0 if the
        request is refused: the most accurate full order has run then
    limit : what ends these frames; empty if they are all
    expected : error of the chosen level on the motions of the calibration, times the factor
    estimate : estimated error over these frames, times the factor; None if the request is refused
    level : title of the level that made the positions
    reduced : whether that is a reduction
    failed : titles of the levels that were tried before
    checks : numbers of the frames that were checked
    work : estimated nanoseconds, of all that was run
    full_work : those of the cheapest full order that meets the tolerance in the calibration, alone
    seconds : processor time of all frames, without what is made before the first of them
    """

    positions: np.ndarray
    frames: int
    limit: str
    expected: float
    estimate: float | None
    level: str
    reduced: bool
    failed: list[str]
    checks: list[int]
    work: float
    full_work: float
    seconds: float

    @property
    def met(self) -> bool:
        """Whether the tolerance counts as met for any frames."""
        return self.frames > 0


class RequestedRun:
    """A run of ``scene`` within the tolerance of ``request``, by levels of a ``calibration``.

    Attributes
    ----------
    full_order : the cheapest full order that meets it in the calibration, else the most accurate
    """

    def __init__(
        self, scene: Scene, calibration: Calibration, request: Request, on_work: OnWork = silent
    ) -> None:
        self.scene, self._own, self._request = scene, calibration, request
        self._frames, self._on_work = scene.config.frames, on_work
        self._good = calibration.admissible(request)
        full = (each for each in self._good if not each.reduced)
        self.full_order = next(full, calibration.most_accurate)

    def outcome(self) -> Outcome:
        """Do all frames; each call is a run of its own."""
        self._work, self._seconds, checks, failed = 0.0, 0.0, list[int](), list[str]()
        known, limit = self._own.horizon(self._request)
        known = min(known, self._frames)
        for level in self._attempts():
            run, estimate = self._checked(level)
            checks, estimates = list(run.defects), np.full(self._frames, estimate)
            if estimate <= self._request.error:
                estimates = np.maximum(estimates, self._amplified(level, run))
            end = last_within(estimates[:known], self._request.error)
            if end == known > 0 or level is self._own.most_accurate:
                break
            failed.append(level.level.title)
            log.info("%s: replaced", level.level.title)
        end *= end >= JUDGED * self._frames
        self._spend(level.work * (self._frames - run.frames), run.to(self._frames))
        limit = AMPLIFIED if end < known else limit
        return Outcome(
            run.positions,
            end,
            limit if end < self._frames else "",
            self._own.expected(level, self._request),
            float(estimates[end - 1]) if end else None,
            level.level.title,
            level.reduced,
            failed,
            checks,
            self._work,
            self._frames * self.full_order.work,
            self._seconds,
        )

    def _attempts(self) -> Iterator[Calibrated]:
        """Levels to run until one is within the tolerance, the most accurate full order last.

        At first a reduction, if there is one that pays; full orders each have at most half the
        expected error of the one before. A request that no full order meets is left to the last.
        """
        best, error = self._own.most_accurate, np.inf
        most = WORTH * self._cost(self.full_order)
        reductions = (each for each in self._good if each.reduced and self._cost(each) < most)
        yield from (each for each in (next(reductions, None),) if each)
        for each in self._good:
            expected = self._own.expected(each, self._request)
            if not each.reduced and each is not best and expected <= error / 2.0:
                error = expected
                yield each
        yield best

    def _cost(self, level: Calibrated) -> float:
        """Estimated nanoseconds of a run with its checks and the second run."""
        second, (exact, frames) = self._own.second(level, self._request), self._checks(level)
        checks = len(frames) * (exact.work(self.scene) + IN_PYTHON)
        return checks + self._frames * (level.work + second.work)

    def _checks(self, level: Calibrated) -> tuple[Level, list[int]]:
        """Level that checks frames of ``level``, and which."""
        if not level.reduced:
            return exact_level(level.level), check_frames(self._frames, np.inf, 1.0)
        exact, share = self.full_order.level, self._own.settings.share
        cost = (exact.work(self.scene) + IN_PYTHON) / self.full_order.work
        share *= min(1.0, 0.01 / self._request.error)
        return exact, check_frames(self._frames, cost, share)

    def _checked(self, level: Calibrated) -> tuple[Trajectory, float]:
        """Run ``level`` up to its end or the first check that fails; and its estimated error.

        The error expected is enlarged as the root mean square of the defects is; it is infinite
        where nothing was expected, or the run blew up.
        """
        expected = self._own.expected(level, self._request)
        run = Trajectory(level.level, self.scene, on_work=self._on_work)
        exact_of, frames = self._checks(level)
        exact = Trajectory(exact_of, self.scene)
        estimate = expected
        for frame in frames if np.isfinite(expected) else []:
            run.to(frame).check(exact)
            self._work += exact_of.work(self.scene) + IN_PYTHON
            size = np.sqrt(np.mean(np.square(list(run.defects.values()))))
            estimate = expected * _ratio(size / self._own.motions[0].unit, level.defect)
            if not (estimate <= self._request.error and self._bounded(run)):
                self._spend(level.work * run.frames, run, exact)
                return run, np.inf
        run.to(self._frames)
        self._spend(level.work * run.frames, run, exact)
        return run, estimate if self._bounded(run) else np.inf

    def _bounded(self, run: Trajectory) -> bool:
        return bool(np.ptp(run.end, axis=0).max() <= BLOWUP_EXTENT * self.scene.mesh.extent)

    def _amplified(self, level: Calibrated, run: Trajectory) -> np.ndarray:
        """Estimated errors (F,) over the first frames of a ``run`` from that of a second level.

        The error expected is enlarged as the distance of both is over the one expected.
        """
        own, request = self._own, self._request
        second = own.second(level, request)
        other = Trajectory(second.level, self.scene, moved=True, on_work=self._on_work)
        positions = run.positions
        apart = relative_errors(other.differences(positions), positions, request.quantity)
        self._spend(second.work * self._frames, other)
        errors = own.expected(level, request), own.expected(second, request)
        usual = sum(errors) / own.settings.factor
        return errors[0] * np.maximum(1.0, apart / usual)

    def _spend(self, work: float, *runs: Trajectory) -> None:
        """Count the ``work`` of ``runs`` and their time since it was last counted."""
        self._work += work
        for run in runs:
            self._seconds, run.seconds = self._seconds + run.seconds, 0.0


def _ratio(size: float, usual: float) -> float:
    """Ratio to the usual size, at least one; infinite where that is zero and this is not."""
    return max(1.0, size / usual) if usual > 0.0 else (1.0 if size == 0.0 else np.inf)


def check_frames(frames: int, cost: float, share: float) -> list[int]:
    """Frames at which a run is checked: as many as cost the share of it, at least `CHECKS`.

    cost : of a check, in frames
    """
    count = min(max(CHECKS, int(share * frames / cost)), frames)
    return sorted({int(f) for f in (np.arange(count) + 0.5) * frames / count})
