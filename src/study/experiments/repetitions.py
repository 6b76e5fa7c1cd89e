"""Repeated reduced runs, runs that change one choice of the method at a time, bases of round-off.

A run depends on choices that are arbitrary: the training frames, and the last digits of the start.
If a conclusion depends on the error of a run, repetitions with other choices show the scatter of
that error. With several training motions, held-out motions are repetitions, too. A ladder leads
from published to sound choices, one per rung. Projections that are round-off make bases of noise.
"""

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, Literal

import h5py
import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.held_out import MOTIONS
from pdrom.model.metrics import relative_errors
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction import snapshots as sets
from pdrom.reduction.basis import Basis, basis_of, compute_basis
from pdrom.reduction.deviations import error_within
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun, displacement_norms
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.sampling.local_step import rerun_reduced
from study.artifact import paths
from study.artifact.reads import Settings
from study.experiments.kit import base as kit
from study.experiments.kit import runfiles
from study.experiments.kit.base import experiment

Varied = Literal["start", "training", "motions"]
log = logging.getLogger(__name__)
COLUMNS = [
    "scene", "group", "method", "r", "varied", "seed", "gain", "finite", "error",
]  # fmt: skip
LADDER_COLUMNS = [
    "scene", "group", "direction", "rung", "rows_per_element", "entries", "r", "condition", "gain",
    "error_train", "error_heldout", "finite", "blowup_frame", "relative_error_within_horizon",
    "repetitions", "error_median", "error_low", "error_high", "gain_low", "gain_high",
]  # fmt: skip
NOISE_COLUMNS = [
    "scene", "group", "noisy_axes", "seed", "method", "r", "rank", "gain", "frames", "finite",
    "blowup_frame", "relative_error",
]  # fmt: skip
ALL, PLANE, VERTEX = "all", "plane", "vertex"
Methods = Mapping[str, MethodSpec]
Runs = list[tuple[dict[str, Any], Rerun | None]]  # (table row, run) of all runs from one start
Rungs = Annotated[tuple[MethodSpec, ...], Field(min_length=1)]


class Repetitions(ConfigModel):
    """Settings of repeated runs.

    repetitions : number of random draws, with seeds 1, 2, ...
    perturbation : length of random displacements of initial positions, relative to the extent
    """

    repetitions: Annotated[int, Field(ge=1, le=1000)] = 5
    perturbation: kit.Tolerance = 1e-10


@dataclass(frozen=True)
class ReducedRuns:
    """Runs of a scene with one group reduced, compared with its full-order run.

    data : snapshots of the group
    reference : (F + 1, N, 3) m, positions of the full-order run
    end : first frame that is not compared (the horizon)
    blowup_extent : multiple of the rest shape's extent above which a run ends as a blow-up
    """

    scene: Scene
    group: str
    data: sets.SnapshotSet
    reference: np.ndarray
    end: int
    blowup_extent: float
    _bases: dict[tuple[str, int | None, int | None], Basis] = field(default_factory=dict)

    @cached_property
    def displacement(self) -> np.ndarray:
        """Norms (F,) m of the full-order run's displacement from its first positions, by frame."""
        return displacement_norms(self.reference)

    def until_the_end(self) -> "ReducedRuns":
        """Copy with the run shortened to frames before ``end``, but to two frames at least."""
        frames = min(self.scene.config.frames, max(2, self.end))
        scene = self.scene.changed(frames=frames)
        return replace(self, scene=scene, reference=self.reference[: frames + 1])

    def basis(
        self, method: MethodSpec, frames: int | None = None, signs: int | None = None
    ) -> Basis:
        """Basis for ``method``; seeds ``frames`` and ``signs`` draw training frames and signs."""
        key = (method.basis_id, frames, signs)
        if key not in self._bases:
            train = None if frames is None else drawn(self.data, frames)
            flips = None if signs is None else np.random.default_rng(signs)
            self._bases[key] = basis_of(self.data, method, train, flips)
        return self._bases[key]

    def run(self, reduction: Reduction, offset: np.ndarray | None = None) -> Rerun:
        """Run with ``reduction``, with initial positions displaced by ``offset`` (N, 3) m."""
        return rerun_reduced(
            self.scene, self.group, reduction, self.reference, self.blowup_extent, offset=offset
        )

    def error(self, outcome: Rerun) -> float | None:
        """Relative error of a run over frames before ``end``; None if it stopped earlier."""
        return error_within(outcome.difference, self.displacement, self.end)

    def repeat(
        self, method: MethodSpec, sizes: Sequence[int], varied: Varied, asked: Repetitions
    ) -> list[dict[str, Any]]:
        """Rows of every repetition of ``method`` at each of ``sizes`` up to the rank, by size.

        ``varied`` is what is drawn at random: initial positions, or training snapshots. Errors are
        over the frames before ``end``, inf for a run that stopped earlier.
        """
        rows, made, offset = [], {}, None
        if varied == "start":
            made = reductions(self.basis(method), method, sizes)
        for seed in range(1, asked.repetitions + 1):
            if varied == "start":
                offset = kit.perturbation_field(self.scene, asked.perturbation, seed)
            else:
                made = reductions(self.basis(method, frames=seed), method, sizes)
            for r, reduction in made.items():
                outcome = self.run(reduction, offset)
                error = self.error(outcome)
                row = {"r": r, "seed": seed, "gain": reduction.gain, "finite": outcome.finite}
                rows.append({**row, "error": np.inf if error is None else error})
        return sorted(rows, key=lambda row: row["r"])

    def on_motions(
        self, method: MethodSpec, sizes: Sequence[int], counts: Sequence[int]
    ) -> Iterator[dict[str, Any]]:
        """Rows of held-out motions, by a basis for each number of training motions in ``counts``.

        The first training motion is that of the scene, the others are drawn by seeds. Of n motions
        every n-th training snapshot is used. Errors are over the frames before ``end``.
        """
        config, mesh = self.scene.config, self.scene.mesh
        frames = self.data.frames["train"]
        found = [self.data.train]
        for seed in range(1, max(counts)):
            scene = Scene.build(config.training_variant(seed), mesh)
            found.append(recorded(scene, self.group)[1][frames])
        tests = [Scene.build(config.heldout_variant(motion), mesh) for motion in MOTIONS]
        runs = [replace(self, scene=s, reference=trajectory(s)) for s in tests]
        for count in counts:
            train = np.concatenate([p[::count] for p in found[:count]])
            made = reductions(basis_of(self.data, method, train), method, sizes)
            for r, reduction in made.items():
                row = {"r": r, "varied": f"held out, {count} trained", "gain": reduction.gain}
                for number, own in enumerate(runs, 1):
                    outcome = own.run(reduction)
                    error = own.error(outcome)
                    row |= {"seed": number, "finite": outcome.finite}
                    yield {**row, "error": np.inf if error is None else error}


def recorded(
    scene: Scene, group: str, start: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (F + 1, N, 3) m of the full-order run, and projections (F, e p, 3) of ``group``.

    ``start`` (N, 3) m is added to the initial positions.
    """
    own, projections = scene.group(group), list[np.ndarray]()
    loop, state = scene.stepper(), scene.initial_state(start)
    positions = [state.positions]
    for frame in range(scene.config.frames):
        state, _ = loop.step(state, frame, lambda y: projections.append(own.project(y)))
        positions.append(state.positions)
    return np.stack(positions), np.stack(projections)


def drawn(data: sets.SnapshotSet, seed: int) -> np.ndarray:
    """Draw as many snapshots (n, e p, 3) by ``seed`` from all of ``data`` as are for training."""
    frames = np.concatenate([data.frames["train"], data.frames["test"]])
    chosen = np.random.default_rng(seed).choice(len(frames), len(data.train), replace=False)
    chosen = chosen[np.argsort(frames[chosen])]
    count = len(data.train)
    return np.stack([data.train[i] if i < count else data.test[i - count] for i in chosen])


class Cell(ConfigModel):
    """Runs that are repeated, at each basis size in ``sizes``.

    training_motions : numbers of training motions, each for runs of held-out motions
    """

    sizes: Annotated[tuple[kit.Modes, ...], Field(min_length=1)]
    varied: tuple[Varied, ...] = ("start", "training")
    training_motions: Annotated[tuple[kit.Count, ...], Field(min_length=1)] = (1, 2, 4, 8)


class Cells(Cell):
    """Repeated runs: every method at every size in every scene, for all of its groups."""

    scenes: Annotated[tuple[SceneName, ...], Field(min_length=1)]
    methods: Annotated[tuple[str, ...], Field(min_length=1)]


class RepetitionSection(Repetitions):
    """Section ``repetitions``: how runs are repeated, and which runs."""

    cells: tuple[Cells, ...] = ()


class Repeated(Cell):
    """A method whose runs of the job's scene and group are repeated, with its specification."""

    method: str
    spec: MethodSpec


class Ladder(Repetitions):
    """Methods (rungs) that differ in one choice each; runs are repeated on other training frames.

    r : basis size of all rungs (the numerical rank if that is smaller)
    signs : number of repetitions of the first rung with other signs of the singular vectors
    repeated : scenes whose runs are repeated
    up, down : methods from the published to the sound one; the sound one without a choice each
    square : separate or shared coefficients with single rows or whole elements as samples, at each
        of ``sizes``; p single rows replace an element of p rows, for equal numbers of entries
    """

    r: Annotated[int, Field(ge=1, le=100_000)] = 20
    signs: Annotated[int, Field(ge=0, le=100)] = 0
    repeated: tuple[str, ...] = ()
    up: Rungs = ()
    down: Rungs = ()
    square: tuple[MethodSpec, ...] = ()
    sizes: tuple[kit.Modes, ...] = ()

    def rungs(self, p: int) -> list[tuple[str, MethodSpec, int | None, int]]:
        """List (direction, method, seed of signs, size r) of all runs; ``p``: rows per element."""
        rows: list[tuple[str, MethodSpec, int | None, int]] = []
        rows += [("up", method, None, self.r) for method in self.up]
        rows += [("down", method, None, self.r) for method in self.down]
        rows += [("signs", self.up[0], seed, self.r) for seed in range(1, self.signs + 1)]
        square = [
            method.model_copy(update={"oversampling": p * method.oversampling})
            if method.rows == "joint"
            else method
            for method in self.square
        ]
        return rows + [("square", method, None, r) for r in self.sizes for method in square]


class LadderSection(Ladder):
    """Section ``ladder``: the methods, and ``scenes`` whose reduced groups are run with them."""

    scenes: tuple[str, ...] = ()


class NoiseRuns(ConfigModel):
    """Runs with bases computed from projections that are only round-off.

    sizes : numbers of modes
    repetitions : number of randomly displaced initial positions
    perturbation : displacement of a vertex relative to the extent: a few units of round-off
    """

    sizes: Annotated[tuple[kit.Modes, ...], Field(min_length=1)] = (6, 10, 20)
    repetitions: Annotated[int, Field(ge=1, le=1000)] = 20
    perturbation: Annotated[float, Field(gt=0.0, le=1e-12)] = 1e-15


class Noise(NoiseRuns):
    """Section ``noise``: ``cases`` maps scenes to a group; scenes not in the study are ignored."""

    cases: dict[str, str] = Field(default_factory=dict)
    methods: tuple[str, ...] = ("deim-joint", "published")


class Options(ConfigModel):
    """Settings of a scene with one group reduced; None omits the runs of ladder or noise."""

    scene: SceneConfig
    repetitions: Repetitions
    repeated: tuple[Repeated, ...]
    own_ladder: Ladder | None
    own_noise: NoiseRuns | None
    noise_methods: dict[str, MethodSpec]
    horizon: kit.Horizon
    blowup_extent: kit.BlowupExtent


@experiment(
    "Repeated runs of {scene}, {group} reduced",
    reads={
        "mesh": paths.MESH,
        "fom": paths.TRAIN,
        "snapshots": paths.SNAPSHOTS,
        "sensitivity": paths.SENSITIVITY,
        "settings": Settings(Options),
    },
    writes={
        "out": paths.REPETITIONS,
        "rungs": paths.LADDER,
        "noise": paths.NOISE,
        "noise_runs": paths.NOISE_RUNS,
    },
)
def repetitions(settings: Options, **files: paths.File) -> None:
    """Run repetitions, ladder, and reductions with bases of round-off, for one scene and group.

    Tables of runs that the configuration does not request have no rows.
    """
    labels = files["out"].labels
    runs = ReducedRuns(
        kit.scene_of(settings.scene, files["mesh"]),
        labels["group"],
        sets.load_snapshots(files["snapshots"].path),
        reference=kit.positions_of(files["fom"]),
        end=settings.horizon.frames(files["sensitivity"]),
        blowup_extent=settings.blowup_extent,
    )
    short = runs.until_the_end()
    rows = []
    for own in settings.repeated:
        for varied in own.varied:
            cell = {**labels, "method": own.method, "varied": varied}
            if varied == "motions":
                found = list(runs.on_motions(own.spec, own.sizes, own.training_motions))
            else:
                found = short.repeat(own.spec, own.sizes, varied, settings.repetitions)
            rows += [cell | row for row in found]
        log.info("%s", own.method)
    write_table(pd.DataFrame(rows, columns=COLUMNS), files["out"].path)
    climbed = [] if settings.own_ladder is None else _ladder(runs, short, settings.own_ladder)
    table = pd.DataFrame([{**labels, **row} for row in climbed], columns=LADDER_COLUMNS)
    whole = dict.fromkeys(("blowup_frame", "repetitions", "entries"), "Int64")
    write_table(table.astype(whole), files["rungs"].path)
    methods, limit, reduced = settings.noise_methods, settings.blowup_extent, []
    with write_hdf5(files["noise_runs"].path) as file:
        if settings.own_noise is not None:
            reduced = noisy_runs(short.scene, runs.group, settings.own_noise, methods, limit, file)
    table = pd.DataFrame([{**labels, **row} for row in reduced], columns=NOISE_COLUMNS)
    write_table(table.astype({"frames": "Int64", "blowup_frame": "Int64"}), files["noise"].path)


def _ladder(runs: ReducedRuns, short: ReducedRuns, ladder: Ladder) -> Iterator[dict[str, Any]]:
    """Yield the row of every method of the ladder; repetitions use ``short``, shortened runs."""
    data = runs.data
    for direction, method, seed, r in ladder.rungs(data.rows_per_element):
        rung = method.title if seed is None else f"signs {seed}"
        row: dict[str, Any] = {"direction": direction, "rung": rung, "r": r}
        row["rows_per_element"] = data.rows_per_element
        basis = runs.basis(method, signs=seed)
        if direction == "square" and r > basis.rank:
            continue
        size = min(r, basis.rank)
        # without modes (projections that are only round-off) there is no reduction
        for reduction in reductions(basis, method, [size] if size else []).values():
            outcome = runs.run(reduction)
            row |= {**outcome.row(runs.displacement), "r": size}
            row["relative_error_within_horizon"] = runs.error(outcome)
            row["entries"] = sum(len(block.entries) for block in reduction.blocks)
            row |= {"condition": reduction.condition, "gain": reduction.gain}
            for split in ("train", "heldout"):
                p = getattr(data, split)
                found = relative_errors(p, reduction.reconstruct(p), data.roundoff)
                row[f"error_{split}"] = found[0]
            repeated = runs.scene.config.name in ladder.repeated
            if repeated and seed is None and direction != "square":
                again = short.repeat(method, [size], "training", ladder)
                errors, gains = ([own[name] for own in again] for name in ("error", "gain"))
                if again:
                    row |= {"repetitions": len(again), "error_median": float(np.median(errors))}
                    row |= {"error_low": min(errors), "error_high": max(errors)}
                    row |= {"gain_low": min(gains), "gain_high": max(gains)}
        yield row
        log.info("%s, %s", direction, rung)


def noisy_runs(
    scene: Scene, group: str, asked: NoiseRuns, methods: Methods, limit: float, file: h5py.File
) -> list[dict[str, Any]]:
    """Perturb initial positions, run, compute bases without a cutoff of round-off, and rerun.

    Returns the rows of all runs with the ``group`` reduced by each of ``methods``. For each of
    `kinds` the runs of one start go to ``file``, as in `study.experiments.reruns`, marked if r
    exceeds the rank; ``limit`` is the extent of a blow-up relative to that of the rest shape.
    """
    rows = []
    for axes in kinds(scene):
        kept: Runs = []
        for seed in range(1, asked.repetitions + 1):
            start = roundoff_field(scene, axes, asked.perturbation, seed=seed)
            found = list(_noisy(scene, group, start, asked.sizes, methods, limit))
            rows += [{"noisy_axes": axes, "seed": seed, **row} for row, _ in found]
            if not kept or (irregular(found) and not irregular(kept)):
                kept = found
        for row, outcome in kept:
            store = file.create_group(f"{axes}/{row['method']}/r{row['r']:04d}")
            store.attrs.update(r=row["r"], marked=outcome is None)
            if outcome is not None:
                runfiles.store_end(store, outcome)
        log.info("%s: %d starts", axes, asked.repetitions)
    return rows


def irregular(runs: Runs) -> bool:
    """Whether some method completes runs at some basis sizes and blows up at others."""
    ends: dict[str, set[bool]] = {}
    for row, outcome in runs:
        if outcome is not None:
            ends.setdefault(row["method"], set()).add(outcome.finite)
    return any(len(seen) > 1 for seen in ends.values())


def kinds(scene: Scene) -> tuple[str, ...]:
    """Names of the sets of coordinates that are perturbed at the start of ``scene``, in turn.

    They are all coordinates. For a flat mesh also those in its plane, and those in its plane with
    the normal coordinate of a single vertex.
    """
    return (ALL, PLANE, VERTEX) if np.ptp(scene.mesh.points, axis=0).min() == 0.0 else (ALL,)


def roundoff_field(scene: Scene, axes: str, size: float, seed: int) -> np.ndarray:
    """Random displacement (N, 3) m, zero in coordinates outside of the set ``axes`` of `kinds`.

    ``size`` is its length relative to the extent; ``seed`` draws the displacement and the vertex.
    """
    field = kit.perturbation_field(scene, size, seed)
    if axes != ALL:
        still = np.ones(len(field), dtype=bool)
        if axes == VERTEX:
            moved = np.flatnonzero(field.any(axis=1))
            still[np.random.default_rng(seed).choice(moved)] = False
        field[np.ix_(still, np.ptp(scene.mesh.points, axis=0) == 0.0)] = 0.0
    return field


def _noisy(
    scene: Scene, name: str, start: np.ndarray, sizes: Sequence[int], methods: Methods, limit: float
) -> Iterator[tuple[dict[str, Any], Rerun | None]]:
    """Yield (row, run) of all reductions, with initial positions displaced by ``start`` (N, 3) m.

    The reductions are trained on all projections of its full-order run, even if they are round-off:
    there is no cutoff, and no axis is left out. A method with separate systems has, as published,
    a system for an axis in which nothing moves; elsewhere in this study such an axis has none.
    """
    group, plan, frames = scene.group(name), scene.config.reduce[name], scene.config.frames
    reference, projections = recorded(scene, name, start)
    even = sets.training_frames(frames, min(plan.train, (frames + 1) // 2))
    trained_on, masses = projections[even], sets.row_masses(group, scene.masses)
    displacement = displacement_norms(reference)
    for method, spec in methods.items():
        basis = compute_basis(trained_on, masses, 0.0, group.rows_per_element, spec)
        basis = replace(basis, active_axes=(True, True, True))
        made = reductions(basis, spec, sizes)
        for r in sizes:
            row = {"method": method, "r": r, "rank": basis.rank, "frames": 0}
            outcome = None
            if r in made:
                outcome = rerun_reduced(scene, name, made[r], reference, limit)
                row |= {"gain": made[r].gain, **outcome.row(displacement)}
            yield row, outcome
