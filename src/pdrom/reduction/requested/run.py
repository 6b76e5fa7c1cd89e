"""Runs with an error within a requested tolerance, by the cheapest solver that suffices.

A level of accuracy (`Level`) is a full-order or reduced solver. Calibration runs every level on two
motions with reference runs solved to convergence: the training motion and a variation of it. The
scene is run by the cheapest level whose error on both, times a safety factor, is within the
tolerance.

The defect of a frame is the distance to the result of a more accurate level from the same state. A
run accumulates defects and amplifies them. The error of a run is estimated as its level's error in
the calibration, times the larger of two ratios if that is above 1: of the defect in checked frames
to that in the calibration, and of the distance to a run of a second level, with a perturbed start,
to that expected from the calibration. The tolerance counts as met for the first frames over which
the estimate is within it. If it is missed in later frames, a full-order level replaces a reduced
one, and the most accurate level replaces that. No decision depends on timings.
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from pdrom.core.errors import ConfigurationError, PdromError, choices
from pdrom.core.yamlfile import ConfigModel, shown
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.requested import levels
from pdrom.reduction.requested.levels import Level, Motion, OnFrame, Quantity, Trajectory, silent
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, sample_elements

log = logging.getLogger(__name__)

Count = Annotated[int, Field(ge=1, le=10_000)]

# Seed of the second motion for the calibration of levels of accuracy: the training motion, varied
# at random (`HeldOut.further`). The motions that train reductions have smaller seeds.
CALIBRATED = 100
# Least part of the frames in which a run must meet its tolerance, and its error must be measurable.
JUDGED = 0.1
PROBED = 6  # number of frames in which `Trajectory.check` measures the error of a calibration run
CHECKS = 2  # smallest number of frames in which `Trajectory.check` measures the error of a run
# A reduction is run only if its estimated cost, with that of checking its errors, is below this
# fraction of the full order's cost. A smaller saving could be an error of the estimates.
WORTH = 2.0 / 3.0
FEW = 20  # models of more modes are made only of meshes with at least as many vertices per mode
# A run counts as blown up if its bounding box is larger than that at rest by more than this factor.
BLOWUP_EXTENT = 100.0
UNKNOWN = "after it, round-off decides the motion, or it is not solved accurately enough"
AMPLIFIED = "a second run, of another accuracy and moved by round-off, departs after it"


class Request(ConfigModel):
    """Largest allowed relative error of a run against the implicit step solved to convergence.

    error : largest relative error, such as 0.01 for one per cent
    quantity : "position" or "velocity", whose error over all frames is limited
    """

    error: Annotated[float, Field(gt=0.0, lt=1.0)]
    quantity: Quantity = "position"

    def __str__(self) -> str:
        plural = {"position": "positions", "velocity": "velocities"}
        return f"{100 * self.error:g} % of the {plural[self.quantity]}"


def read_request(wish: object, source: str = "error") -> Request:
    """Read a requested tolerance: a `Request`, a number, or text such as "velocity=0.05".

    ConfigurationError, naming ``source``, if the quantity is unknown or the number not in (0, 1).
    """
    if isinstance(wish, Request):
        return wish
    quantity, given, number = str(wish).rpartition("=")
    if given and quantity not in levels.QUANTITIES:
        allowed = choices(quantity, levels.QUANTITIES)
        raise ConfigurationError(f"{source}: unknown quantity {shown(quantity, 60)}{allowed}")
    try:
        error = float(number)
    except ValueError:
        error = float("nan")
    if isinstance(wish, bool) or not 0.0 < error < 1.0:
        raise ConfigurationError(
            f"{source} = {shown(wish, 60)}: a number above 0 and below 1 is required, such as 0.01 "
            "or velocity=0.05"
        )
    return Request.model_validate({"error": error, **({"quantity": quantity} if given else {})})


class ToleranceSettings(ConfigModel):
    """Levels of accuracy that are calibrated, and the safety factor of their errors.

    modes, tolerances : numbers of modes k and sampling tolerances tau of the reductions
    frames : largest number of frames of each training motion from which elements are sampled
    training_motions : number of motions that train the reductions, the training motion included
    plain, accelerated : numbers of full-order iterations, without and with Anderson acceleration
    residuals : of full orders that L-BFGS solves (see `Level.residual`)
    iterations : numbers of iterations of the reductions, all with Anderson acceleration
    factor : safety factor by which estimated errors are multiplied
    every : a reduction is checked in one of this many frames
    """

    modes: tuple[Count, ...] = (20, 40, 120)
    tolerances: tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...] = (5e-2, 1e-2)
    frames: Count = 25
    training_motions: Annotated[int, Field(ge=1, le=64)] = 8
    iterations: tuple[Count, ...] = (5, 10, 20)
    plain: tuple[Count, ...] = (1, 2, 3, 5)
    accelerated: tuple[Count, ...] = (5, 10, 20, 40, 80)
    residuals: tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...] = (1e-5, 1e-7)
    factor: Annotated[float, Field(ge=1.0, le=1e3)] = 4.0
    every: Count = 20


@dataclass(frozen=True)
class Calibrated:
    """A level of accuracy with its cost and its errors on the motions of the calibration.

    work : estimated cost of a frame, ns
    errors : for each motion, relative errors (F,) over the first 1, ..., F frames
    defect : largest error made in one frame, relative to the motion's root mean square displacement
    ms : processor time of a frame of the first motion, ms
    """

    level: Level
    work: float
    errors: list[np.ndarray]
    defect: float
    ms: float

    @property
    def reduced(self) -> bool:
        """Whether the level is a reduced model."""
        return self.level.model is not None


@dataclass(frozen=True)
class Outcome:
    """Result of a run within a requested tolerance, by one of several solvers ("levels").

    positions : (F + 1, N, 3) m; entry 0 is the initial state
    frames : n if the estimated error is within the tolerance over the first n frames; 0 if no
        level can meet it: the most accurate full-order level has run instead
    limit : reason why later frames are not within the tolerance; empty if all frames are
    expected : largest error of ``level`` on `Calibration.motions`, times the safety factor
    estimate : estimated error over ``frames`` frames, times the safety factor; None without frames
    level : title of the level that computed the positions
    reduced : whether that level is a reduced model
    failed : titles of the levels that were run before and did not meet the tolerance
    checks : numbers of the frames that were checked
    seconds : processor time of all computed frames, without preparations before the first one
    full_ms : processor time, ms, of a frame, without checks, by the cheapest full-order level that
        meets the tolerance in the calibration
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
    seconds: float
    full_ms: float

    @property
    def met(self) -> bool:
        """Whether the tolerance counts as met for at least one frame."""
        return self.frames > 0


@dataclass(frozen=True)
class Calibration:
    """Solvers (``levels`` of accuracy), the cheapest first, and ``motions`` on which they ran.

    All errors are those of one quantity, positions or velocities. The argument ``error`` of a
    method is a requested tolerance.
    """

    levels: list[Calibrated]
    motions: list[Motion]
    settings: ToleranceSettings

    @property
    def most_accurate(self) -> Calibrated:
        """Full-order level whose frames are solved to convergence."""
        return next(each for each in self.levels if each.level is levels.EXACT)

    def horizon(self, error: float) -> int:
        """Number of first frames in which ``error`` is measurable.

        In later frames what is unknown of a motion is larger than ``error`` over the safety factor.
        """
        unknown = np.maximum(*(motion.unknown for motion in self.motions))
        return levels.last_within(unknown, error / self.settings.factor)

    def expected(self, level: Calibrated, error: float) -> float:
        """Largest error of ``level`` on all `motions` up to the `horizon`, times the safety factor.

        It is at least the error of the reference runs, times this factor. It is infinite if the
        `horizon` has fewer frames than the fraction `JUDGED` of the frames of the training motion.
        """
        end = self.horizon(error)
        if end < max(JUDGED * self.motions[0].scene.config.frames, 1):
            return np.inf
        known = [*level.errors, *(motion.unknown for motion in self.motions)]
        return self.settings.factor * float(max(errors[end - 1] for errors in known))

    def admissible(self, error: float) -> list[Calibrated]:
        """Levels whose `expected` error is at most ``error``; [] if no full-order level is so."""
        good = [each for each in self.levels if self.expected(each, error) <= error]
        return good if any(not each.reduced for each in good) else []

    def full_order(self, error: float) -> Calibrated:
        """Cheapest `admissible` full-order level of accuracy, else the most accurate level."""
        full = (each for each in self.admissible(error) if not each.reduced)
        return next(full, self.most_accurate)

    def second(self, level: Calibrated, error: float) -> Calibrated:
        """Cheapest other level for comparison with ``level``, reduced if and only if ``level`` is.

        Its expected error is at most ``error`` times the safety factor; without one: ``level``.
        """
        most = error * self.settings.factor
        alike = [each for each in self.levels if each.reduced == level.reduced]
        others = (e for e in alike if e is not level and self.expected(e, error) <= most)
        return next(others, level)

    def attempts(self, error: float) -> list[Calibrated]:
        """Levels of accuracy to run in turn until one meets the tolerance ``error``.

        First the cheapest `admissible` reduction whose run, checks and comparison run (by `second`)
        cost less than `WORTH` times a full-order run and its comparison run; then the cheapest
        `admissible` full-order level, if any; last the most accurate full-order level.
        """
        full = self.full_order(error)
        most = WORTH * (full.work + self.second(full, error).work)
        checks = full.work / self.settings.every
        reduced = (each for each in self.admissible(error) if each.reduced)
        pays = [e for e in reduced if e.work + self.second(e, error).work + checks < most]
        others = [full] if full is self.most_accurate else [full, self.most_accurate]
        return [*pays[:1], *others]


class CheckedRun:
    """Run of ``scene`` within the tolerance ``error`` by one of the levels of ``calibration``."""

    def __init__(
        self, calibration: Calibration, scene: Scene, error: float, on_frame: OnFrame = silent
    ) -> None:
        self._own, self._scene, self._error = calibration, scene, error
        self._frames, self._on_frame = scene.config.frames, on_frame
        self._started: list[Trajectory] = []

    def outcome(self) -> Outcome:
        """Run all frames and return the result; each call starts a new run."""
        self._started.clear()
        own, error, frames, failed = self._own, self._error, self._frames, list[str]()
        known = min(own.horizon(error), frames)
        for level in own.attempts(error):
            run, estimates = self._estimated(level)
            end = levels.last_within(estimates[:known], error)
            if end == known > 0 or level is own.most_accurate:
                break
            failed.append(level.level.title)
            log.info("%s: replaced", level.level.title)
        end *= end >= JUDGED * frames
        return Outcome(
            positions=run.to(frames).positions,
            frames=end,
            limit="" if end == frames else AMPLIFIED if end < known else UNKNOWN,
            expected=own.expected(level, error),
            estimate=float(estimates[end - 1]) if end else None,
            level=level.level.title,
            reduced=level.reduced,
            failed=failed,
            checks=list(run.defects),
            seconds=sum(each.seconds for each in self._started),
            full_ms=own.full_order(error).ms,
        )

    def _start(self, level: Level, moved: bool = False) -> Trajectory:
        self._started.append(Trajectory(level, self._scene, moved, self._on_frame))
        return self._started[-1]

    def _estimated(self, level: Calibrated) -> tuple[Trajectory, np.ndarray]:
        """Run ``level`` to the end or to a failed check; return the run and estimated errors (F,).

        Each error is the larger of two estimates. The first is that of `_amplified`, the second is
        `Calibration.expected`: if the run's root mean square defect (error made in one frame) is
        larger than the largest defect in the calibration, it is multiplied by their ratio. A check
        fails if the second estimate exceeds the tolerance, or the mesh blows up. All errors are inf
        if a check failed or `Calibration.expected` is inf; later ones if L-BFGS did not converge.
        """
        own, frames, full = self._own, self._frames, self._own.full_order(self._error).level
        largest = BLOWUP_EXTENT * self._scene.mesh.extent
        run = self._start(level.level)
        exact = self._start(full if level.reduced else level.level.exact)
        hopeless = np.full(frames, np.inf)
        expected = estimate = own.expected(level, self._error)
        if not np.isfinite(expected):
            return run, hopeless
        for frame in check_frames(frames, frames // own.settings.every if level.reduced else 0):
            run.to(frame).check(exact)
            size = np.sqrt(np.mean(np.square(list(run.defects.values())))) / own.motions[0].unit
            with np.errstate(divide="ignore", invalid="ignore"):  # fmax ignores 0 / 0 = nan
                estimate = expected * float(np.fmax(1.0, np.divide(size, level.defect)))
            if not (estimate <= self._error and np.ptp(run.ends[-1], axis=0).max() <= largest):
                return run, hopeless
        if not np.ptp(run.to(frames).ends[-1], axis=0).max() <= largest:
            return run, hopeless
        estimates = np.maximum(estimate, self._amplified(level, run))
        estimates[run.solved :] = np.inf
        return run, estimates

    def _amplified(self, level: Calibrated, run: Trajectory) -> np.ndarray:
        """Estimate errors (F,) over the first 1, ..., F frames of ``run``, a run with ``level``.

        A second run, with `Calibration.second`, has a perturbed start. The error expected of
        ``level`` is multiplied by max(1, difference of the runs / sum of both levels' errors). The
        estimate is at least the difference of the runs minus the error expected of the second.
        """
        own, second = self._own, self._own.second(level, self._error)
        other = self._start(second.level, moved=True).to(self._frames)
        positions = run.positions
        differences = positions[1:] - other.positions[1:]
        apart = levels.relative_errors(differences, positions, own.motions[0].quantity)
        errors = own.expected(level, self._error), own.expected(second, self._error)
        usual = sum(errors) / own.settings.factor
        return np.maximum(errors[0] * np.maximum(1.0, apart / usual), apart - errors[1])


def check_frames(frames: int, count: int) -> list[int]:
    """Indices of frames to check: max(``count``, `CHECKS`) of them, spread over ``frames``."""
    count = min(max(CHECKS, count), frames)
    return sorted({int(f) for f in (np.arange(count) + 0.5) * frames / count})


def calibrate(
    training: Scene,
    settings: ToleranceSettings,
    quantity: Quantity = "position",
    on_frame: OnFrame = silent,
) -> Calibration:
    """Run every level of ``settings`` on the ``training`` motion and on a variation of it.

    ``quantity`` is the one whose errors count. ``on_frame`` is called after each frame.
    """
    far = training.config.training_variant(CALIBRATED).effects
    scenes = training, training.changed(effects=far)
    motions = [Motion(scene, quantity, on_frame) for scene in scenes]
    full = [levels.EXACT, *(Level(levels.LIMIT, residual=size) for size in settings.residuals)]
    full += [Level(count) for count in settings.plain]
    full += [Level(count, levels.WINDOW) for count in settings.accelerated]
    found: list[Calibrated] = []
    for level in (*full, *_reduced(training, motions[0], settings)):
        try:
            found.append(_calibrated(level, motions, on_frame))
        except PdromError as error:
            if level.model is None:
                raise
            log.warning("%s: left out (%s)", level.title, error)
    return Calibration(sorted(found, key=lambda each: each.work), motions, settings)


def _reduced(training: Scene, motion: Motion, settings: ToleranceSettings) -> Iterator[Level]:
    """Yield the reduced levels of accuracy; none if a model of the scene cannot be made.

    They are trained on the reference run of ``motion`` and on runs of other motions with
    20 iterations per frame and Anderson acceleration.
    """
    frames = np.arange(0, training.config.frames, 2)
    few = frames[:: -(-len(frames) // settings.frames)]
    # the sampling of elements is trained on 20 iterations per frame of a run in the subspace
    scene, config = training.iterated(20), training.config
    try:
        seeds = range(1, settings.training_motions)
        variants = [config.training_variant(seed).effects for seed in seeds]
        others = [scene.changed(effects=effects) for effects in variants]
        runs = [motion.reference]
        runs += [trajectory(other.iterated(20, levels.WINDOW)) for other in others]
        seen = np.concatenate([run[1:][frames] for run in runs])
        for k in (k for k in settings.modes if k <= max(FEW, training.mesh.vertices / FEW)):
            columns = make_columns(scene, seen, "pod", k=k)
            found = sample_elements(
                scene, columns, few, tolerances=settings.tolerances, others=others
            )
            for tau, samples in zip(settings.tolerances, found, strict=True):
                model = SubspaceModel("pod", columns, samples)
                for count in settings.iterations:
                    yield Level(count, levels.WINDOW, model=model, tau=tau)
    except PdromError as error:
        log.warning("%s: no reduction (%s)", training.config.name, error)


def _calibrated(level: Level, motions: Sequence[Motion], on_frame: OnFrame) -> Calibrated:
    errors, defects, ms = [], [0.0], []
    for motion in motions:
        frames = motion.scene.config.frames
        run, exact = motion.run, Trajectory(level.exact, motion.scene)
        if level is not levels.EXACT:
            run = Trajectory(level, motion.scene, on_frame=on_frame)
            for frame in np.unique(np.linspace(0, frames - 1, PROBED + 1).round().astype(int)[1:]):
                defects.append(run.to(int(frame)).check(exact) / motion.unit)
        errors.append(motion.errors(run.to(frames).positions))
        ms.append(1e3 * run.seconds / frames)
    defect = float(np.nan_to_num(max(defects), nan=np.inf))
    log.info("%s: errors %s", level.title, ", ".join(f"{own[-1]:.2e}" for own in errors))
    return Calibrated(level, level.work(motion.scene, run.iterations), errors, defect, ms[0])


def transferred(trained: Scene, scene: Scene) -> Scene:
    """Return ``trained`` with the material, masses, time step, frames, obstacles of ``scene``.

    Errors of full-order and reduced solvers depend on these quantities and are calibrated with
    them. Held vertices, their paths and the initial velocity remain those of ``trained``.
    ConfigurationError, naming ``scene``, if it has another mesh or other constraint groups.
    """
    mesh, own = trained.mesh, scene.mesh
    alike = [
        np.array_equal(getattr(mesh, name), getattr(own, name))
        for name in ("points", "triangles", "tetrahedra")
    ]
    groups = [[(g.name, g.elements) for g in s.groups] for s in (trained, scene)]
    if not all(alike) or groups[0] != groups[1]:
        raise ConfigurationError(
            f"scene '{scene.config.name}': the training run is of another mesh or other constraint "
            f"groups (scene '{trained.config.name}')"
        )
    effects = scene.config.effects
    motions = [[each.config for each in (*s.boundaries, *s.starts)] for s in (trained, scene)]
    if motions[0] != motions[1]:
        material = (*scene.groups, *scene.forces, *scene.contacts)
        effects = (*(each.config for each in material), *motions[0])
    return scene.changed(effects=effects)
