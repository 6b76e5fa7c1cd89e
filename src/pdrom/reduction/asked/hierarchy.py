"""All levels of a scene, tried on its training motion and one that is made from it."""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from pdrom.core.errors import PdromError
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import Scene
from pdrom.reduction.asked.ask import Ask
from pdrom.reduction.asked.level import IN_PYTHON, WINDOW, Level
from pdrom.reduction.asked.measured import CONVERGED, Motion, Tried, tried, worst
from pdrom.reduction.asked.motions import VALIDATION
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, sample_elements

log = logging.getLogger(__name__)

# No promise is made where less than this part of a motion's frames can be judged: it would be kept
# by next to nothing.
JUDGED = 0.1
# A reduction is taken where it needs less than this part of the full order's time, its checks
# included: counted work is no closer to the time.
WORTH = 2.0 / 3.0
CHECKS = 2  # of a reduction's run, at least

Count = Annotated[int, Field(ge=1, le=10_000)]


class AskSettings(ConfigModel):
    """Levels that are tried, and the factor of the estimates.

    modes, tolerances : of the reductions: k, tau
    frames : of the training motion that the elements are sampled for, at most
    plain, accelerated : iterations of the full order, without and with acceleration
    iterations : of the reductions, accelerated
    factor : by which estimates are multiplied; calibrated, see table asks
    share : of the full order's time that checks may cost, for an ask of 1 %; a share inversely
        proportional to the ask, and never more than this
    """

    modes: tuple[Count, ...] = (20, 40)
    tolerances: tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...] = (5e-2, 1e-2)
    frames: Count = 25
    iterations: tuple[Count, ...] = (5, 10, 20)
    plain: tuple[Count, ...] = (1, 2, 3, 5)
    accelerated: tuple[Count, ...] = (5, 10, 20, 40)
    factor: Annotated[float, Field(ge=1.0, le=1e3)] = 4.0
    share: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.05


@dataclass(frozen=True)
class Step:
    """A level with its outcome on each own motion, the training motion first.

    work : estimated nanoseconds of a frame
    """

    level: Level
    work: float
    tried: list[Tried]


@dataclass(frozen=True)
class Hierarchy:
    """Steps of a scene, in the order of their work.

    training : the scene with its training motion
    unit : root mean square displacement of a frame of that motion, m
    horizon : frames that a promise can be made for
    """

    steps: list[Step]
    training: Scene
    unit: float
    horizon: int

    @property
    def full(self) -> list[Step]:
        """Steps of the full order."""
        return [step for step in self.steps if step.level.model is None]

    def expected(self, step: Step, ask: Ask) -> float:
        """Largest error of the ``step`` on the own motions, in the quantity of the ``ask``.

        Infinite where too few frames count.
        """
        judged = self.horizon >= JUDGED * self.training.config.frames
        return worst(step.tried, ask.quantity) if judged else np.inf

    def defect(self, step: Step) -> float:
        """Largest defect of the step on the own motions, in units of the motion."""
        return max(float(each.defects.max(initial=0.0)) for each in step.tried)

    def estimated(self, step: Step, ask: Ask, defect: float) -> float:
        """Error, as the ``ask`` measures it, of a run of the ``step`` with this ``defect``.

        The defect is a root mean square in units of the motion.
        """
        known = self.defect(step)
        return self.expected(step, ask) * max(1.0, defect / known if known > 0.0 else np.inf)

    def admissible(self, ask: Ask, factor: float) -> list[Step]:
        """Steps that keep to the ask on the own motions when errors are ``factor`` times larger.

        In the order of their work; the last one is a full-order step, and a reduction is taken if
        it is `WORTH` it beside the first of these. Empty where even the full order would break the
        promise.
        """
        good = [s for s in self.steps if factor * self.expected(s, ask) <= ask.error]
        full = next((s for s in good if s.level.model is None), None)
        if full is None:
            return []
        checks = CHECKS * self.check_work(self.sure(ask)) / self.training.config.frames
        return [s for s in good if s.level.model is None or s.work + checks < WORTH * full.work]

    def sure(self, ask: Ask) -> Level:
        """The cheapest full order that is much better than the ``ask``, to check reductions by."""
        good = (s.level for s in self.full if self.expected(s, ask) <= ask.error / 3.0)
        return next(good, CONVERGED)

    def check_work(self, level: Level) -> float:
        """Estimated nanoseconds of a check by the full-order ``level``, with Python around it."""
        return level.work(self.training) + IN_PYTHON


def hierarchy(training: Scene, settings: AskSettings) -> tuple[Hierarchy, list[Motion]]:
    """Try every level of ``settings`` on the ``training`` motion and the validation motion.

    Returns
    -------
    The hierarchy, and the motions with their references.
    """
    motions = [Motion(training), Motion(VALIDATION.of(training))]
    most = max(motion.iterations for motion in motions)
    levels = [*_full(settings, most), *_reduced(training, motions[0], settings)]
    steps = []
    for level in levels:
        try:
            found = [tried(level, motion) for motion in motions]
        except PdromError as error:
            if level.model is None:
                raise
            log.warning("%s: left out (%s)", level.title, error)
            continue
        steps.append(Step(level, level.work(training, motions[0].touching), found))
        errors = [f"{each.errors['position']:.2e}" for each in found]
        log.info("%s: errors %s", level.title, ", ".join(errors))
    steps.sort(key=lambda step: step.work)
    horizon = min(motion.end for motion in motions)
    return Hierarchy(steps, training, motions[0].unit, horizon), motions


def _full(settings: AskSettings, most: int) -> Iterator[Level]:
    """The full order; also with the ``most`` iterations of a reference, and with half of many."""
    yield Level(most, WINDOW)
    if most > CONVERGED.iterations:
        yield Level(most // 2, WINDOW)
    yield from (Level(count) for count in settings.plain)
    yield from (Level(count, WINDOW) for count in settings.accelerated)


def _reduced(training: Scene, motion: Motion, settings: AskSettings) -> Iterator[Level]:
    """Reductions trained on converged frames; none where the scene does not take a subspace."""
    frames = np.arange(0, training.config.frames, 2)
    few = frames[:: -(-len(frames) // settings.frames)]
    # iterates of the samples' training run, in the subspace
    scene = Level(20).scene(training)
    try:
        for k in settings.modes:
            columns = make_columns(scene, motion.reference[1:][frames], "pod", k=k)
            found = sample_elements(scene, columns, few, tolerances=settings.tolerances)
            for tau, samples in zip(settings.tolerances, found, strict=True):
                model = SubspaceModel("pod", columns, samples)
                yield from (Level(count, WINDOW, model, tau) for count in settings.iterations)
    except PdromError as error:
        log.warning("%s: no reduction (%s)", training.config.name, error)


def check_frames(frames: int, cost: float, share: float) -> Sequence[int]:
    """Frames at which a run is checked: as many as cost the share of it, at least `CHECKS`.

    cost : of a check, in frames
    """
    count = min(max(CHECKS, int(share * frames / cost)), frames)
    return sorted({int(f) for f in (np.arange(count) + 0.5) * frames / count})
