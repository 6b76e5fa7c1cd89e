"""Calibration: every level of accuracy, run on two motions whose converged frames are known.

The motions are that of the training run and one that is made from it. The reference of a motion is
its implicit step, solved with so many accelerated iterations that half of them make no difference
to the tolerance. Its error is not zero: it counts as that of half the iterations.

A run adds up the defects of its frames, the distances to what converged iterations make of the same
state, and the motion amplifies them. A run of another motion therefore has the error of the
calibration, enlarged by as much as its defects are larger, or as two of its levels are further
apart than here.
"""

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal, get_args

import numpy as np
from pydantic import Field

from pdrom.core.errors import ConfigurationError, PdromError, choices
from pdrom.core.yamlfile import ConfigModel, shown
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.effects.entries import effect_config
from pdrom.model.held_out import KICK
from pdrom.model.scene import Scene
from pdrom.reduction.requested.levels import WINDOW, Level, OnWork, Trajectory, silent
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, sample_elements

log = logging.getLogger(__name__)

Quantity = Literal["position", "velocity"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
Count = Annotated[int, Field(ge=1, le=10_000)]

# A reference has so many iterations, or twice as many until half of them agree, up to the most.
CONVERGED, MOST = Level(80, WINDOW), 320
# The motion that is made from the training motion: slower handles, a kick, stiffer constraints.
SLOWER, KICKED, KICK_SEED, STIFFER = 0.9, 0.8, 101, 1.6
# No error is known where less than this part of a motion's frames can be judged.
JUDGED = 0.1
PROBED = 6  # frames of a run in calibration whose defects are taken


class Request(ConfigModel):
    """Largest relative error of a run against its implicit step, solved to convergence.

    error : 0.01 is one per cent
    quantity : whose error it is, over all frames
    """

    error: Annotated[float, Field(gt=0.0, lt=1.0)]
    quantity: Quantity = "position"

    def __str__(self) -> str:
        plural = {"position": "positions", "velocity": "velocities"}
        return f"{100 * self.error:g} % of the {plural[self.quantity]}"


def read_request(wish: object, source: str = "error") -> Request:
    """Read a requested tolerance: a `Request`, a number, or text such as "velocity=0.05".

    Raises
    ------
    ConfigurationError
        Naming ``source``: no number above 0 and below 1, or an unknown quantity.
    """
    if isinstance(wish, Request):
        return wish
    quantity, given, number = str(wish).rpartition("=")
    if given and quantity not in QUANTITIES:
        raise ConfigurationError(
            f"{source}: unknown quantity {shown(quantity, 60)}{choices(quantity, QUANTITIES)}"
        )
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
    """Levels that are calibrated, and the factor of the estimates.

    modes, tolerances : of the reductions: k, tau
    frames : of the training motion that the elements are sampled for, at most
    plain, accelerated : iterations of the full order, without and with acceleration
    iterations : of the reductions, accelerated
    factor : by which estimated errors are multiplied
    share : of the full order's time that checks may cost, for a tolerance of 1 %; a share inversely
        proportional to the tolerance, and never more than this
    """

    modes: tuple[Count, ...] = (20, 40)
    tolerances: tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...] = (5e-2, 1e-2)
    frames: Count = 25
    iterations: tuple[Count, ...] = (5, 10, 20)
    plain: tuple[Count, ...] = (1, 2, 3, 5)
    accelerated: tuple[Count, ...] = (5, 10, 20, 40)
    factor: Annotated[float, Field(ge=1.0, le=1e3)] = 4.0
    share: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.05


def relative_errors(
    differences: Iterable[np.ndarray], reference: np.ndarray, quantity: Quantity
) -> np.ndarray:
    """Errors (F,) over the first 1, 2, ... F frames, relative to the motion in these frames.

    Velocities are finite differences of positions between frames. An error is infinite where the
    run is not finite, or where nothing moves and something is wrong.

    Parameters
    ----------
    differences : (N, 3) m of each frame's end to the ``reference`` (F + 1, N, 3) m
    """
    moved, squares = reference[1:] - reference[0], []
    before = np.zeros_like(reference[0])
    with np.errstate(over="ignore", invalid="ignore"):
        for wrong in differences:
            own = wrong - before if quantity == "velocity" else wrong
            squares.append(float(np.sum(own**2)))
            before = wrong
        errors = np.cumsum(squares)
        if quantity == "velocity":
            moved = np.diff(reference, axis=0)
        sizes = np.cumsum(np.sum(moved[: len(errors)] ** 2, axis=(1, 2)))
        relative = np.sqrt(errors / np.where(sizes > 0.0, sizes, np.nan))
    relative[(sizes == 0.0) & (errors == 0.0)] = 0.0
    return np.nan_to_num(relative, nan=np.inf, posinf=np.inf)


def last_within(errors: np.ndarray, tolerance: float) -> int:
    """Most frames over which the ``errors``, see `relative_errors`, are within ``tolerance``."""
    within = np.flatnonzero(errors <= tolerance)
    return int(within[-1]) + 1 if len(within) else 0


class Motion:
    """The motion of ``scene`` with its reference, solved to ``tolerance``.

    Attributes
    ----------
    reference : (F + 1, N, 3) m
    iterations : of the reference
    unconverged : of each quantity the errors (F,) of half the iterations
    sensitivity : of each quantity the differences (F,) that a start moved by round-off makes
    """

    def __init__(self, scene: Scene, tolerance: float, on_work: OnWork = silent) -> None:
        self.scene = scene
        count, frames = CONVERGED.iterations, scene.config.frames

        def run(iterations: int) -> np.ndarray:
            level = Level(iterations, WINDOW)
            return Trajectory(level, scene, on_work=on_work).to(frames).positions

        half, self.reference = run(count // 2), run(count)
        moved = Trajectory(Level(count // 2, WINDOW), scene, moved=True, on_work=on_work)
        apart = list(moved.differences(half))
        self.sensitivity = {q: relative_errors(apart, half, q) for q in QUANTITIES}
        known = last_within(self.sensitivity["position"], tolerance)
        self.unconverged = self._errors(half)
        while last_within(self.unconverged["position"], tolerance) < known and count < MOST:
            count, half = 2 * count, self.reference
            self.reference = run(count)
            self.unconverged = self._errors(half)
        self.iterations = count

    def _errors(self, run: np.ndarray) -> dict[Quantity, np.ndarray]:
        return {q: self.errors(run, q) for q in QUANTITIES}

    def errors(self, positions: np.ndarray, quantity: Quantity) -> np.ndarray:
        """Errors (F',) of a run with ``positions`` (F' + 1, N, 3) m, see `relative_errors`."""
        wrong = (a - b for a, b in zip(positions[1:], self.reference[1:], strict=False))
        return relative_errors(wrong, self.reference, quantity)

    def ends(self, tolerance: float, quantity: Quantity) -> tuple[int, int]:
        """Frames over which ``tolerance`` can be judged: until convergence, until round-off."""
        found = self.unconverged[quantity], self.sensitivity[quantity]
        return last_within(found[0], tolerance), last_within(found[1], tolerance)

    @cached_property
    def unit(self) -> float:
        """Root mean square displacement of a frame, m."""
        moved = np.linalg.norm(self.reference[1:] - self.reference[0], axis=(1, 2))
        return float(np.sqrt(np.mean(moved**2)))

    @cached_property
    def touching(self) -> float:
        """Share of all frames at whose end a vertex that is not held touches a contact."""
        frames = self.scene.config.frames
        return sum(self._touches(frame) for frame in range(frames)) / frames

    def _touches(self, frame: int) -> bool:
        free = np.ones(self.scene.mesh.vertices, dtype=bool)
        for boundary in self.scene.boundaries:
            if boundary.active(frame):
                free[boundary.held(frame)] = False
        points = self.reference[frame + 1, free]
        return any((contact.gaps(points) <= 0.0).any() for contact in self.scene.contacts)


@dataclass(frozen=True)
class Calibrated:
    """A level with its outcome on the motions.

    work : estimated nanoseconds of a frame
    errors : of each motion, by quantity, (F,) over the first frames
    defect : largest defect of a frame, in units of the motion
    ms : processor time of a frame of the first motion
    """

    level: Level
    work: float
    errors: list[dict[Quantity, np.ndarray]]
    defect: float
    ms: float

    @property
    def reduced(self) -> bool:
        """Whether it is a reduction."""
        return self.level.model is not None


@dataclass(frozen=True)
class Calibration:
    """Calibrated ``levels``, in the order of their work, and the ``motions`` with references."""

    levels: list[Calibrated]
    motions: list[Motion]
    settings: ToleranceSettings

    @property
    def full(self) -> list[Calibrated]:
        """Levels of the full order."""
        return [each for each in self.levels if not each.reduced]

    @property
    def most_accurate(self) -> Calibrated:
        """The full order with the most iterations."""
        return max(self.full, key=lambda each: (each.level.iterations, each.level.window))

    def horizon(self, request: Request) -> tuple[int, str]:
        """Frames whose errors are known well enough for the ``request``, and what ends them."""
        tolerance = request.error / self.settings.factor
        ends = np.array([m.ends(tolerance, request.quantity) for m in self.motions]).min(axis=0)
        reasons = "the iterations converge too slowly after it", "round-off decides after it"
        return int(ends.min()), reasons[int(ends[1] < ends[0])]

    def expected(self, level: Calibrated, request: Request) -> float:
        """Largest error of ``level`` on the motions before the horizon, times the factor.

        None is smaller than that of the references. Infinite where too few frames are known.
        """
        end, _ = self.horizon(request)
        if end < max(JUDGED * self.motions[0].scene.config.frames, 1):
            return np.inf
        known = [*level.errors, *(motion.unconverged for motion in self.motions)]
        largest = max(errors[request.quantity][end - 1] for errors in known)
        return self.settings.factor * float(largest)

    def admissible(self, request: Request) -> list[Calibrated]:
        """Levels whose expected error is within the request; none if no full order is one."""
        good = [each for each in self.levels if self.expected(each, request) <= request.error]
        return good if any(not each.reduced for each in good) else []

    def second(self, level: Calibrated, request: Request) -> Calibrated:
        """The cheapest other level of the same kind with an error about as large as requested.

        ``level`` itself if there is none.
        """
        most = request.error * self.settings.factor
        alike = [each for each in self.levels if each.reduced == level.reduced]
        others = (e for e in alike if e is not level and self.expected(e, request) <= most)
        return next(others, level)


def calibrate(
    training: Scene, settings: ToleranceSettings, tolerance: float, on_work: OnWork = silent
) -> Calibration:
    """Run every level of ``settings`` on the ``training`` motion and the one made from it.

    Parameters
    ----------
    tolerance : smallest relative error that will be requested
    on_work : told of all frames that are done
    """
    scenes = (training, varied(training))
    motions = [Motion(scene, tolerance / settings.factor, on_work) for scene in scenes]
    most = max(motion.iterations for motion in motions)
    levels: list[Calibrated] = []
    for level in (*_full(settings, most), *_reduced(training, motions[0], settings)):
        try:
            levels.append(_calibrated(level, motions, on_work))
        except PdromError as error:
            if level.model is None:
                raise
            log.warning("%s: left out (%s)", level.title, error)
    return Calibration(sorted(levels, key=lambda each: each.work), motions, settings)


def varied(scene: Scene) -> Scene:
    """The motion that is made from that of ``scene``; none of the study's held-out ones."""
    own = scene.config.held_out
    speed, axes = KICKED * (own.kick or KICK), own.kick_axes
    kick = {"effect": "kick", "speed": speed, "seed": KICK_SEED, "axes": axes}
    effects = [effect.with_frames_scaled(SLOWER) for effect in scene.config.effects]
    effects = [
        e.model_copy(update={"weight": STIFFER * e.weight}) if isinstance(e, GroupConfig) else e
        for e in effects
    ]
    effects.append(effect_config(kick, len(effects)))
    config = scene.config.model_copy(update={"effects": tuple(effects)})
    return Scene.build(config, scene.mesh, masses=scene.masses)


def transferred(trained: Scene, scene: Scene) -> Scene:
    """The training motion with the material, masses, step, frames and obstacles of ``scene``.

    A calibration rests on all of these. Held vertices, their paths and the start are those of
    the ``trained`` scene.

    Raises
    ------
    ConfigurationError
        Naming the scene: it has another mesh or other constraint groups.
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
    config = scene.config.model_copy(update={"effects": effects})
    return Scene.build(config, scene.mesh, masses=scene.masses)


def _calibrated(level: Level, motions: Sequence[Motion], on_work: OnWork) -> Calibrated:
    errors, defects, ms = [], [0.0], []
    for motion in motions:
        frames = motion.scene.config.frames
        run = Trajectory(level, motion.scene, on_work=on_work)
        exact = Trajectory(exact_level(level), motion.scene)
        for frame in np.unique(np.linspace(0, frames - 1, PROBED + 1).round().astype(int)[1:]):
            run.to(int(frame))
            defects.append(run.check(exact) / motion.unit)
        positions = run.to(frames).positions
        errors.append({q: motion.errors(positions, q) for q in QUANTITIES})
        ms.append(1e3 * run.seconds / frames)
    work = level.work(motions[0].scene, motions[0].touching)
    found = Calibrated(level, work, errors, float(np.nan_to_num(max(defects), nan=np.inf)), ms[0])
    log.info("%s: errors %s", level.title, ", ".join(f"{e['position'][-1]:.2e}" for e in errors))
    return found


def exact_level(level: Level) -> Level:
    """A full order that sees what a frame of ``level`` misses: with twice its iterations."""
    return CONVERGED if level.model is not None else Level(2 * level.iterations, WINDOW)


def _full(settings: ToleranceSettings, most: int) -> Iterator[Level]:
    """Full-order levels: of ``settings``, the reference's ``most`` iterations, half of them."""
    yield Level(most, WINDOW)
    if most > CONVERGED.iterations:
        yield Level(most // 2, WINDOW)
    yield from (Level(count) for count in settings.plain)
    yield from (Level(count, WINDOW) for count in settings.accelerated)


def _reduced(training: Scene, motion: Motion, settings: ToleranceSettings) -> Iterator[Level]:
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
