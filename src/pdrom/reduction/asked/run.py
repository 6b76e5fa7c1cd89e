"""A run that keeps to an asked error: checked, repaired in time, ended in full order if it must.

Some frames of a reduction are done twice, by it and by the full order from the same state, which
gives the reduction's defect there exactly. Defects beyond those of the motions that it was tried on
raise the estimate. When it leaves the ask the run goes back to its last checked state, or to the
start while little is spent, and goes on with a more accurate level. The full order is not checked:
it is what a check would go on with. Nothing depends on the clock.
"""

import logging
from dataclasses import dataclass

import numpy as np

from pdrom.model.dynamics.stepper import State
from pdrom.model.scene import Scene
from pdrom.reduction.asked.ask import Ask
from pdrom.reduction.asked.hierarchy import AskSettings, Hierarchy, Step, check_frames
from pdrom.reduction.asked.level import Level, Running
from pdrom.reduction.asked.loops import Loops
from pdrom.reduction.asked.measured import defect

log = logging.getLogger(__name__)

# A run starts anew while it has spent less than this part of a full-order run.
EARLY = 0.05
# A run that has grown to this multiple of the mesh has blown up, whatever a check says.
BLOWUP_EXTENT = 100.0


@dataclass
class Asked:
    """Outcome of a run with an asked error.

    positions : (F + 1, N, 3) m, the initial ones first
    promised : whether the estimate keeps to the ask; False: nothing that was tried does, or the
        full order blew up
    expected : error on the motions that the choice was made on, times the factor
    estimate : estimated error of the run, times the factor; None without a check
    changes : frames from which on another level went on, and its title; the first one at frame 0
    checks : frames that were checked, of the run as it is
    repairs : how often the run went back
    reduced : frames that were done by a reduction
    work : estimated nanoseconds, checks and repairs included
    full_work : those of a run by the cheapest full order that keeps to the ask
    seconds : processor time of the frames, without what is made before the first of them
    """

    positions: np.ndarray
    promised: bool
    expected: float
    estimate: float | None
    changes: list[tuple[int, str]]
    checks: list[int]
    repairs: int
    reduced: int
    work: float
    full_work: float
    seconds: float


@dataclass(frozen=True)
class _Done:
    """A run up to the end of a frame.

    ends : loop and its coordinates (n, 3) at the end of every frame, the initial ones first
    state : of all vertices at the end
    parts : (frame, step, defect) of every check
    changes : (frame, step) from which on a step went on
    """

    ends: tuple[tuple[Running, np.ndarray], ...]
    state: State
    parts: tuple[tuple[int, Step, float], ...] = ()
    changes: tuple[tuple[int, Step], ...] = ()

    @property
    def frame(self) -> int:
        """The next frame."""
        return len(self.ends) - 1


class CheckedRun:
    """A run of ``scene`` that keeps to ``ask``, with the levels of a hierarchy of its mesh.

    What is made before the first frame (operators, factors) is made here.

    Parameters
    ----------
    own : made of the training motion
    settings : those that the hierarchy was made with
    loops : on the motion of ``scene``, in place of fresh ones
    """

    def __init__(
        self,
        scene: Scene,
        own: Hierarchy,
        ask: Ask,
        settings: AskSettings,
        loops: Loops | None = None,
    ) -> None:
        self._loops = loops or Loops(scene)
        self.scene, self._own, self._ask, self._settings = scene, own, ask, settings
        self._frames = scene.config.frames
        self._steps = own.admissible(ask, settings.factor)
        # where no error can be told, the dearest
        best = min(own.full, key=lambda step: (own.expected(step, ask), -step.work))
        self._dear = next((s for s in self._steps if s.level.model is None), best)
        self._running: dict[tuple[int, int, int], Running] = {}
        first = self._steps[0] if self._steps else self._dear
        checks = [] if first.level.model is None else [self._check(first)]
        for level in (first.level, *checks, self._dear.level):
            self._on(level)

    @property
    def full_order(self) -> Level:
        """The cheapest full order that keeps to the ask; the most accurate one if none does."""
        return self._dear.level

    def _on(self, level: Level) -> Running:
        key = level.iterations, level.window, id(level.model)  # models live as long as the run
        if key not in self._running:
            self._running[key] = self._loops.on(level)
        return self._running[key]

    def outcome(self) -> Asked:
        """Do all frames; each call is a run of its own."""
        self._repairs, self._work = 0, 0.0
        promised = bool(self._steps)
        step = self._steps[0] if promised else self._dear
        expected = self._settings.factor * self._own.expected(step, self._ask)
        start = self.scene.initial_state()
        whole, started = self._on(self._dear.level), self._loops.clock()
        kept = begun = _Done(((whole, start.positions),), start)
        while kept.frame < self._frames:
            done, keeps = self._advance(kept, step)
            if keeps or step.level.model is None:
                promised, kept = promised and keeps, done
                continue
            self._repairs += 1
            early = self._work <= EARLY * self._frames * self._dear.work
            kept, step = begun if early else kept, self._better(step, kept.frame)
            log.info("frame %d: goes on with %s", kept.frame, step.level.title)
        return self._told(kept, promised, expected, self._loops.clock() - started)

    def _advance(self, kept: _Done, step: Step) -> tuple[_Done, bool]:
        """Frames up to the next check or the end; whether the estimate is within the ask."""
        running, planned = self._on(step.level), self._next_check(step, kept.frame)
        until = self._frames if planned is None else planned[0] + 1
        state = running.inside(kept.state)
        before, ends = state, []
        for after in running.run(state, range(kept.frame, until)):
            before, state = state, after
            ends.append((running, after.positions))
        self._work += step.work * (until - kept.frame)
        changes, parts = kept.changes, kept.parts
        if not changes or changes[-1][1] is not step:
            changes = (*changes, (kept.frame, step))
        end = running.outside(state)
        if planned is not None:
            checked, check = planned
            self._work += self._own.check_work(check)
            exact = self._on(check)
            size = defect(running.outside(before), end, exact, checked) / self._own.unit
            parts = (*parts, (checked, step, size))
        done = _Done((*kept.ends, *ends), end, parts, changes)
        extent = float(np.ptp(end.positions, axis=0).max()) / self.scene.mesh.extent
        estimate = self._estimate(done)
        keeps = extent <= BLOWUP_EXTENT and (estimate is None or estimate <= self._ask.error)
        return done, keeps

    def _next_check(self, step: Step, frame: int) -> tuple[int, Level] | None:
        """The next frame from ``frame`` on that is checked, and by what; None if there is none."""
        if step.level.model is None:
            return None
        check = self._check(step)
        cost = self._own.check_work(check) / self._dear.work
        share = self._settings.share * min(1.0, 0.01 / self._ask.error)
        left = [f for f in check_frames(self._frames, cost, share) if f >= frame]
        return (left[0], check) if left else None

    def _check(self, step: Step) -> Level:
        """The cheapest full order much better than the ask or than the reduction ``step``."""
        own, sure = self._own, self._own.sure(self._ask)
        for other in own.full:
            if other.level is sure or own.defect(other) <= own.defect(step) / 3.0:
                return other.level
        return sure

    def _estimate(self, done: _Done) -> float | None:
        """Estimated error of a run by its checks, times the factor."""
        if not done.parts:
            return None
        squares = 0.0
        for step in {id(s): s for _, s, _ in done.parts}.values():
            own = [size for _, each, size in done.parts if each is step]
            size = float(np.sqrt(np.mean(np.square(own))))
            squares += len(own) * self._own.estimated(step, self._ask, size) ** 2
        return self._settings.factor * float(np.sqrt(squares / len(done.parts)))

    def _better(self, step: Step, frame: int) -> Step:
        """The step to go on with from ``frame`` on after the reduction ``step``.

        A reduction of at most half the error, if that could save more than it would cost to find
        out that it fails, too; else the cheapest full order that keeps to the ask.
        """
        own, ask = self._own, self._ask
        half = [s for s in self._steps if own.expected(s, ask) <= own.expected(step, ask) / 2]
        for other in (s for s in half if s.level.model is not None):
            saved = (self._frames - frame) * (self._dear.work - other.work)
            trial = own.check_work(self._check(other)) + self._frames / 2 * other.work
            if saved > trial:
                return other
        return self._dear

    def _told(self, done: _Done, promised: bool, expected: float, seconds: float) -> Asked:
        ends = [*(frame for frame, _ in done.changes[1:]), self._frames]
        reduced = sum(
            end - begin
            for (begin, step), end in zip(done.changes, ends, strict=True)
            if step.level.model is not None
        )
        return Asked(
            np.stack([running.positions(y) for running, y in done.ends]),
            promised,
            expected,
            self._estimate(done),
            [(frame, step.level.title) for frame, step in done.changes],
            [frame for frame, _, _ in done.parts],
            self._repairs,
            reduced,
            self._work,
            self._frames * self._dear.work,
            seconds,
        )
