"""Reduced runs: repeated, with one choice changed, or with bases computed from rounding errors.

A run depends on arbitrary choices: the training frames, and the last digits of the start.
Repetitions with other choices show the scatter of its error. A "ladder" is a list of methods
("rungs") that leads from the published choices to sound ones and changes one choice at a time.
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
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
from pdrom.reduction.basis import Basis, basis_of, group_basis
from pdrom.reduction.deviations import Yardstick, error_within
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.sampling.model import ProjectionModel
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
# Displacements of vertices, over the mesh's longest side: in repetitions, and of a few round-offs.
MOVED, NOISE = 1e-10, 1e-15
TRAINED_ON = (1, 2, 4, 8)  # numbers of training motions of bases that run held-out motions
Runs = list[tuple[dict[str, Any], Rerun | None]]  # pairs (table row, run); equal initial positions
Rungs = Annotated[tuple[MethodSpec, ...], Field(min_length=1)]


class Repetitions(ConfigModel):
    """Settings of repeated runs: their number; random choices are drawn by the seeds 1, 2, ..."""

    repetitions: kit.Repeats = 5


@dataclass(frozen=True)
class ReducedRuns:
    """Runs with one constraint group reduced, compared with the full-order run.

    data : snapshots of the group's projections
    full : the full-order run
    end : first frame that is not compared, because perturbed full-order runs differ too much in it
    """

    group: str
    data: sets.SnapshotSet
    full: Yardstick
    end: int
    _bases: dict[tuple[str, int | None, int | None], Basis] = field(default_factory=dict)

    def until_the_end(self) -> "ReducedRuns":
        """Return a copy with at most max(2, `end`) frames of the full-order run."""
        frames = min(self.full.scene.config.frames, max(2, self.end))
        scene = self.full.scene.changed(frames=frames)
        return replace(self, full=Yardstick(scene, self.full.reference[: frames + 1]))

    def basis(
        self, method: MethodSpec, frames: int | None = None, signs: int | None = None
    ) -> Basis:
        """Return the basis for ``method``.

        With a seed ``frames``, training frames are drawn from all snapshots of the group; with a
        seed ``signs``, the signs of the singular vectors are drawn.
        """
        key = (method.basis_id, frames, signs)
        if key not in self._bases:
            train = None if frames is None else drawn(self.data, frames)
            flips = None if signs is None else np.random.default_rng(signs)
            self._bases[key] = basis_of(self.data, method, train, flips)
        return self._bases[key]

    def run(self, reduction: Reduction, offset: np.ndarray | None = None) -> Rerun:
        """Run with ``reduction`` from initial positions displaced by ``offset`` (N, 3) m."""
        return self.full.run(ProjectionModel(self.group, reduction), offset)

    def error(self, outcome: Rerun) -> float | None:
        """Relative error of a run over the frames before ``end``; None if it stopped earlier."""
        return error_within(outcome.difference, self.full.displacement, self.end)

    def row(
        self, reduction: Reduction, seed: int, offset: np.ndarray | None = None
    ) -> dict[str, Any]:
        """Row of a run with ``reduction``; the error of one that ended before `end` is inf."""
        outcome = self.run(reduction, offset)
        error = self.error(outcome)
        row = {"r": reduction.r, "seed": seed, "gain": reduction.gain, "finite": outcome.finite}
        return {**row, "error": np.inf if error is None else error}

    def repeat(
        self, method: MethodSpec, sizes: Sequence[int], varied: Varied, asked: Repetitions
    ) -> list[dict[str, Any]]:
        """Return rows of all repetitions of ``method``, at each of ``sizes`` up to the rank.

        ``varied`` tells if initial positions ("start") or training snapshots ("training") are drawn
        at random.
        """
        rows, offset, start = [], None, varied == "start"
        for seed in range(1, asked.repetitions + 1):
            if start:
                offset = kit.perturbation_field(self.full.scene, MOVED, seed)
            basis = self.basis(method, frames=None if start else seed)
            made = reductions(basis, method, sizes).values()
            rows += [self.row(reduction, seed, offset) for reduction in made]
        return sorted(rows, key=lambda row: row["r"])

    def on_motions(
        self, method: MethodSpec, sizes: Sequence[int], counts: Sequence[int]
    ) -> Iterator[dict[str, Any]]:
        """Yield a row per number of training motions (in ``counts``), size r and held-out motion.

        The first training motion is the scene's own, further ones are random variants. Of
        each of n training motions, every n-th training snapshot is used.
        """
        config, mesh = self.full.scene.config, self.full.scene.mesh
        frames = self.data.frames["train"]
        found = [self.data.train]
        for seed in range(1, max(counts)):
            scene = Scene.build(config.training_variant(seed), mesh)
            found.append(sets.recorded(scene, self.group, scene.initial_state())[1][frames])
        tests = [Scene.build(config.heldout_variant(motion), mesh) for motion in MOTIONS]
        runs = [replace(self, full=Yardstick(scene, trajectory(scene))) for scene in tests]
        for count in counts:
            train = np.concatenate([p[::count] for p in found[:count]])
            made = reductions(basis_of(self.data, method, train), method, sizes)
            varied = {"varied": f"held out, {count} trained"}
            for reduction in made.values():
                for number, own in enumerate(runs, 1):
                    yield own.row(reduction, number) | varied


def drawn(data: sets.SnapshotSet, seed: int) -> np.ndarray:
    """Draw as many of all snapshots of ``data`` as are for training, n; result: (n, e p, 3)."""
    frames = np.concatenate([data.frames["train"], data.frames["test"]])
    chosen = np.random.default_rng(seed).choice(len(frames), len(data.train), replace=False)
    return np.concatenate([data.train, data.test])[chosen[np.argsort(frames[chosen])]]


class Cell(ConfigModel):
    """Settings of runs that are repeated.

    sizes : basis sizes of the runs
    varied : what differs in repetitions: initial positions, training frames, or held-out motion
    """

    sizes: Annotated[tuple[kit.Modes, ...], Field(min_length=1)]
    varied: tuple[Varied, ...] = ("start", "training")


class Cells(Cell):
    """Runs to repeat: every method at every size, for each reduced group of each of ``scenes``."""

    scenes: Annotated[tuple[SceneName, ...], Field(min_length=1)]
    methods: Annotated[tuple[str, ...], Field(min_length=1)]


class RepetitionSection(Repetitions):
    """Section ``repetitions`` of the configuration; ``cells`` lists the runs to repeat."""

    cells: tuple[Cells, ...] = ()


class Repeated(Cell):
    """A method, with its specification, whose runs are repeated in the job's scene and group."""

    method: str
    spec: MethodSpec


class Ladder(Repetitions):
    """Methods ("rungs") that differ in single choices; combinations of two choices (``square``).

    r : basis size of all rungs (the numerical rank if that is smaller)
    signs : number of repetitions of the first rung with other signs of the singular vectors
    repeated : scenes whose runs are repeated with other training frames
    up : methods, the published one first, each with one more change; the last is called sound
    down : methods that differ from the sound one in one choice each
    square : methods with separate or with shared coefficients, which sample single rows or whole
        elements, one or more for each mode, each at all ``sizes``; p single rows replace an element
        of p rows, so that numbers of entries are equal
    """

    r: Annotated[int, Field(ge=1, le=100_000)] = 20
    signs: Annotated[int, Field(ge=0, le=100)] = 0
    repeated: tuple[str, ...] = ()
    up: Rungs = ()
    down: Rungs = ()
    square: tuple[MethodSpec, ...] = ()
    sizes: tuple[kit.Modes, ...] = ()

    def rungs(self, p: int) -> list[tuple[str, MethodSpec, int | None, int]]:
        """List all runs as (setting; method; seed for the modes' signs or None; basis size r).

        A setting is "up", "down", "signs" or "square", see `Ladder`. Elements have ``p`` rows.
        """
        square = [
            method.model_copy(update={"oversampling": p * method.oversampling})
            if method.rows == "joint"
            else method
            for method in self.square
        ]
        return [
            *(("up", method, None, self.r) for method in self.up),
            *(("down", method, None, self.r) for method in self.down),
            *(("signs", self.up[0], seed, self.r) for seed in range(1, self.signs + 1)),
            *(("square", method, None, r) for r in self.sizes for method in square),
        ]


class LadderSection(Ladder):
    """Section ``ladder``: all its methods are run for each reduced group of each of ``scenes``."""

    scenes: tuple[str, ...] = ()


class NoiseRuns(ConfigModel):
    """Settings of runs with bases computed from projections that are only rounding errors.

    They are the numbers of modes, and the number of randomly displaced initial positions.
    """

    sizes: Annotated[tuple[kit.Modes, ...], Field(min_length=1)] = (6, 10, 20)
    repetitions: kit.Repeats = 20


class Noise(NoiseRuns):
    """Section ``noise`` of the configuration; ``cases``: scene -> the group that is reduced in it.

    Scenes that are not in the study are ignored.
    """

    cases: dict[str, str] = Field(default_factory=dict)
    methods: tuple[str, ...] = ("deim-joint", "published")


class Options(ConfigModel):
    """Settings for a scene and group; if ``own_ladder`` or ``own_noise`` is None: no such runs."""

    scene: SceneConfig
    repetitions: Repetitions
    repeated: tuple[Repeated, ...]
    own_ladder: Ladder | None
    own_noise: NoiseRuns | None
    noise_methods: dict[str, MethodSpec]
    horizon: kit.Horizon


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
    """Make repeated runs, runs by a list of methods, and runs with bases of rounding errors only.

    All reduce one group of one scene. A table is empty if ``settings`` ask for no runs of its kind.
    """
    labels = files["out"].labels
    runs = ReducedRuns(
        labels["group"],
        sets.load_snapshots(files["snapshots"].path),
        Yardstick(kit.scene_of(settings.scene, files["mesh"]), kit.positions_of(files["fom"])),
        end=settings.horizon.frames(files["sensitivity"]),
    )
    short = runs.until_the_end()
    rows = []
    for own in settings.repeated:
        for varied in own.varied:
            cell = {**labels, "method": own.method, "varied": varied}
            if varied == "motions":
                found = list(runs.on_motions(own.spec, own.sizes, TRAINED_ON))
            else:
                found = short.repeat(own.spec, own.sizes, varied, settings.repetitions)
            rows += [cell | row for row in found]
        log.info("%s", own.method)
    write_table(pd.DataFrame(rows, columns=COLUMNS), files["out"].path)
    climbed = [] if settings.own_ladder is None else _ladder(runs, short, settings.own_ladder)
    table = pd.DataFrame([{**labels, **row} for row in climbed], columns=LADDER_COLUMNS)
    whole = dict.fromkeys(("blowup_frame", "repetitions", "entries"), "Int64")
    write_table(table.astype(whole), files["rungs"].path)
    methods, reduced = settings.noise_methods, []
    with write_hdf5(files["noise_runs"].path) as file:
        if settings.own_noise is not None:
            reduced = noisy_runs(short.full.scene, runs.group, settings.own_noise, methods, file)
    table = pd.DataFrame([{**labels, **row} for row in reduced], columns=NOISE_COLUMNS)
    write_table(table.astype({"frames": "Int64", "blowup_frame": "Int64"}), files["noise"].path)


def _ladder(runs: ReducedRuns, short: ReducedRuns, ladder: Ladder) -> Iterator[dict[str, Any]]:
    """Yield rows for runs of ``ladder``; ``short`` runs methods with other training frames."""
    data = runs.data
    for direction, method, seed, r in ladder.rungs(data.rows_per_element):
        rung = method.title if seed is None else f"signs {seed}"
        row: dict[str, Any] = {"direction": direction, "rung": rung, "r": r}
        row["rows_per_element"] = data.rows_per_element
        basis = runs.basis(method, signs=seed)
        if direction == "square" and r > basis.rank:
            continue
        size = min(r, basis.rank)
        # there is no reduction without modes, that is if all projections are rounding errors
        for reduction in reductions(basis, method, [size] if size else []).values():
            outcome = runs.run(reduction)
            row |= {**runs.full.row(outcome), "r": size}
            row["relative_error_within_horizon"] = runs.error(outcome)
            row["entries"] = sum(len(block.entries) for block in reduction.blocks)
            row |= {"condition": reduction.condition, "gain": reduction.gain}
            for split in ("train", "heldout"):
                p = getattr(data, split)
                found = relative_errors(p, reduction.reconstruct(p), data.roundoff)
                row[f"error_{split}"] = found[0]
            repeated = runs.full.scene.config.name in ladder.repeated
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
    scene: Scene, group: str, asked: NoiseRuns, methods: runfiles.Methods, file: h5py.File
) -> list[dict[str, Any]]:
    """Run a scene from perturbed starts, in full order and with bases of these runs' round-off.

    Returns a row for each run with the ``group`` reduced by one of ``methods``. For each of the
    `kinds` of perturbed start, ``file`` gets the reduced runs of one start, an HDF5 group each: of
    the first start at which only some runs of a method blow up (`irregular`), else of the first.
    No run has a size r above the rank: its row has no results and its HDF5 group ``marked`` = True.
    """
    rows = []
    for axes in kinds(scene):
        kept: Runs = []
        for seed in range(1, asked.repetitions + 1):
            start = roundoff_field(scene, axes, NOISE, seed=seed)
            found = list(_noisy(scene, group, start, asked.sizes, methods))
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
    """Return whether a method completes the run at some basis sizes and blows up at others."""
    ends: dict[str, set[bool]] = {}
    for row, outcome in runs:
        if outcome is not None:
            ends.setdefault(row["method"], set()).add(outcome.finite)
    return any(len(seen) > 1 for seen in ends.values())


def kinds(scene: Scene) -> tuple[str, ...]:
    """Names of the kinds of perturbed start of ``scene``, by the coordinates that are perturbed.

    The first kind perturbs all coordinates. For a flat mesh, the second one perturbs coordinates in
    its plane only, and the third one also the normal coordinate of a single vertex.
    """
    return (ALL, PLANE, VERTEX) if np.ptp(scene.mesh.points, axis=0).min() == 0.0 else (ALL,)


def roundoff_field(scene: Scene, axes: str, size: float, seed: int) -> np.ndarray:
    """Random displacement (N, 3) m; ``axes`` is the kind of perturbed start, one of `kinds`.

    Every vertex moves by ``size`` times the mesh's longest side, before displacements that the kind
    does not allow are removed. ``seed`` draws directions and, for kind `VERTEX`, the vertex.
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
    scene: Scene, name: str, start: np.ndarray, sizes: Sequence[int], methods: runfiles.Methods
) -> Iterator[tuple[dict[str, Any], Rerun | None]]:
    """Yield (row, run) of all reductions, with initial positions displaced by ``start`` (N, 3) m.

    The run is None at a size above the rank. The reductions are trained on projections of the
    full-order run from this start, even if these are rounding errors: no mode is cut off. Where a
    method has a system of equations for each axis, an axis in which nothing moves has one, too, as
    published; in all other runs of the study, such an axis has none.
    """
    group, plan, frames = scene.group(name), scene.config.reduce[name], scene.config.frames
    reference, projections, _ = sets.recorded(scene, name, scene.initial_state(start))
    even = sets.training_frames(frames, min(plan.train, (frames + 1) // 2))
    full = Yardstick(scene, reference)
    for method, spec in methods.items():
        basis = group_basis(group, scene.masses, projections[even], 0.0, spec)
        basis = replace(basis, active_axes=(True, True, True))
        made = reductions(basis, spec, sizes)
        for r in sizes:
            row = {"method": method, "r": r, "rank": basis.rank, "frames": 0}
            outcome = None
            if r in made:
                outcome = full.run(ProjectionModel(name, made[r]))
                row |= {"gain": made[r].gain, **full.row(outcome)}
            yield row, outcome
