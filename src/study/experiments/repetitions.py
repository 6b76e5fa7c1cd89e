"""Reduced runs repeated, and the ladder from the published choices to sound ones.

A run is one draw of what nobody means to choose: which frames train, and the last digits of the
start. Where an error of the run decides something, its repetitions say how much of it is that.
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.metrics import relative_errors
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import Basis, basis_of
from pdrom.reduction.deviations import error_within
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun, displacement_norms
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.sampling.local_step import rerun_reduced
from pdrom.reduction.snapshots import SPLITS, SnapshotSet, load_snapshots
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Settings
from study.experiments.kit.declaration import experiment
from study.experiments.kit.scenes import perturbation_field, positions_of, scene_of
from study.experiments.kit.settings import BlowupExtent, Horizon, Modes, Tolerance
from study.experiments.noise import COLUMNS as NOISE_COLUMNS
from study.experiments.noise import NoiseRuns, noisy_runs

Varied = Literal["start", "training", "both"]
log = logging.getLogger(__name__)
COLUMNS = [
    "scene", "group", "method", "r", "varied", "seed", "gain", "finite", "error",
]  # fmt: skip
VARIED: tuple[Varied, ...] = ("start", "training")
LADDER_COLUMNS = [
    "scene", "group", "direction", "rung", "rows_per_element", "entries", "r", "condition", "gain",
    "error_train", "error_test",
    "error_heldout", "finite", "blowup_frame", "relative_error_within_horizon", "repetitions",
    "error_median", "error_low", "error_high", "gain_low", "gain_high",
]  # fmt: skip
Rungs = Annotated[tuple[MethodSpec, ...], Field(min_length=1)]


class Repetitions(ConfigModel):
    """Settings of repeated runs.

    repetitions : draws, each with a seed of its own, from 1
    perturbation : length by which a start is moved, over the extent
    """

    repetitions: Annotated[int, Field(ge=1, le=1000)] = 5
    perturbation: Tolerance = 1e-10


@dataclass(frozen=True)
class Repetition:
    """One repeated run; ``error`` up to the horizon, inf for a run that ended earlier."""

    r: int
    seed: int
    gain: float
    error: float
    finite: bool


@dataclass(frozen=True)
class ReducedRuns:
    """Runs of a scene with one group reduced, compared with its full-order run.

    data : snapshots of the group
    reference : (F + 1, N, 3) m, positions of the full-order run
    end : first frame that is not judged
    blowup_extent : see `pdrom.reduction.sampling.local_step.rerun`
    """

    scene: Scene
    group: str
    data: SnapshotSet
    reference: np.ndarray
    end: int
    blowup_extent: float
    _bases: dict[tuple[str, int | None, int | None], Basis] = field(default_factory=dict)

    @cached_property
    def displacement(self) -> np.ndarray:
        """Norms (F,) m of the full-order run, see `displacement_norms`."""
        return displacement_norms(self.reference)

    def until_the_end(self) -> "ReducedRuns":
        """Copy of the runs up to the first frame that is not judged, but of two frames at least."""
        frames = min(self.scene.config.frames, max(2, self.end))
        scene = self.scene.changed(frames=frames)
        return replace(self, scene=scene, reference=self.reference[: frames + 1])

    def basis(
        self, method: MethodSpec, frames: int | None = None, signs: int | None = None
    ) -> Basis:
        """Basis for ``method``; seeds may draw training ``frames``, and ``signs`` of the modes."""
        key = (method.basis_id, frames, signs)
        if key not in self._bases:
            train = None if frames is None else drawn(self.data, frames)
            flips = None if signs is None else np.random.default_rng(signs)
            self._bases[key] = basis_of(self.data, method, train, flips)
        return self._bases[key]

    def run(self, reduction: Reduction, offset: np.ndarray | None = None) -> Rerun:
        """Run with ``reduction`` from the scene's start, moved by ``offset`` (N, 3) m."""
        return rerun_reduced(
            self.scene, self.group, reduction, self.reference, self.blowup_extent, offset=offset
        )

    def error(self, outcome: Rerun) -> float | None:
        """Relative error before the end; None for a run that did not get there."""
        return error_within(outcome.difference, self.displacement, self.end)

    def repeat(
        self, method: MethodSpec, sizes: Sequence[int], varied: Varied, asked: Repetitions
    ) -> Iterator[Repetition]:
        """Every repetition of ``method`` at each of ``sizes`` that its basis has.

        ``varied`` says what the seed draws: the start, or the training snapshots.
        """
        own = reductions(self.basis(method), method, sizes) if varied == "start" else None
        for seed in range(1, asked.repetitions + 1):
            made = own
            if made is None:
                made = reductions(self.basis(method, frames=seed), method, sizes)
            offset = None
            if varied != "training":
                offset = perturbation_field(self.scene, asked.perturbation, seed)
            for r, reduction in made.items():
                outcome = self.run(reduction, offset)
                error = self.error(outcome)
                yield Repetition(
                    r, seed, reduction.gain, np.inf if error is None else error, outcome.finite
                )


def drawn(data: SnapshotSet, seed: int) -> np.ndarray:
    """Snapshots (n, e p, 3), as many as train in ``data``, drawn by ``seed`` from all, in order."""
    frames = np.concatenate([data.frames["train"], data.frames["test"]])
    chosen = np.random.default_rng(seed).choice(len(frames), len(data.train), replace=False)
    chosen = chosen[np.argsort(frames[chosen])]
    count = len(data.train)
    return np.stack([data.train[i] if i < count else data.test[i - count] for i in chosen])


class Cells(ConfigModel):
    """Runs that are repeated: every method at every size in every scene (all groups of it)."""

    scenes: Annotated[tuple[SceneName, ...], Field(min_length=1)]
    methods: Annotated[tuple[str, ...], Field(min_length=1)]
    sizes: Annotated[tuple[Modes, ...], Field(min_length=1)]
    varied: tuple[Varied, ...] = VARIED


class RepetitionSection(Repetitions):
    """Section ``repetitions``: how runs are repeated, and which."""

    cells: tuple[Cells, ...] = ()


class Repeated(ConfigModel):
    """A method of the job's scene and group, with what it depends on."""

    method: str
    spec: MethodSpec
    sizes: tuple[Modes, ...]
    varied: tuple[Varied, ...]


class Ladder(Repetitions):
    """The rungs of a ladder; runs are repeated on other training frames.

    r : basis size of all rungs (the numerical rank where that is smaller)
    signs : how many choices of the singular vectors' signs the first rung is repeated with
    repeated : scenes whose runs are repeated
    up, down : methods, from the published one upwards, and the sound one less one ingredient
    square : separate or shared coefficients on single rows or whole elements, at each of ``sizes``;
        rows are sampled p times as often as elements, which have p of them: as many entries
    """

    r: Annotated[int, Field(ge=1, le=100_000)] = 20
    signs: Annotated[int, Field(ge=0, le=100)] = 0
    repeated: tuple[str, ...] = ()
    up: Rungs = ()
    down: Rungs = ()
    square: tuple[MethodSpec, ...] = ()
    sizes: tuple[Modes, ...] = ()

    def rungs(self, p: int) -> list[tuple[str, MethodSpec, int | None, int]]:
        """(direction, method, seed of the signs, size) of all rows of a group, in order."""
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
    """Section ``ladder``: the rungs, and ``scenes`` whose reduced groups are run with them."""

    scenes: tuple[str, ...] = ()


class Options(ConfigModel):
    """Settings of the runs of a scene with a group reduced; no ladder and no noise if None."""

    scene: SceneConfig
    repetitions: Repetitions
    repeated: tuple[Repeated, ...]
    own_ladder: Ladder | None
    own_noise: NoiseRuns | None
    noise_methods: dict[str, MethodSpec]
    horizon: Horizon
    blowup_extent: BlowupExtent


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
def repetitions(
    mesh: File,
    fom: File,
    snapshots: File,
    sensitivity: File,
    settings: Options,
    out: File,
    rungs: File,
    noise: File,
    noise_runs: File,
) -> None:
    """Repeat every listed run of the scene and group, climb the ladder, reduce the round-off.

    What the configuration does not ask of a scene has a table without rows.
    """
    labels = out.labels
    runs = ReducedRuns(
        scene_of(settings.scene, mesh),
        labels["group"],
        load_snapshots(snapshots.path),
        reference=positions_of(fom),
        end=settings.horizon.frames(sensitivity),
        blowup_extent=settings.blowup_extent,
    )
    short = runs.until_the_end()
    rows = []
    for own in settings.repeated:
        for varied in own.varied:
            found = short.repeat(own.spec, own.sizes, varied, settings.repetitions)
            cell = {**labels, "method": own.method, "varied": varied}
            rows += [cell | vars(run) for run in sorted(found, key=lambda run: run.r)]
        log.info("%s", own.method)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)
    climbed = [] if settings.own_ladder is None else _ladder(runs, short, settings.own_ladder)
    table = pd.DataFrame([{**labels, **row} for row in climbed], columns=LADDER_COLUMNS)
    whole = dict.fromkeys(("blowup_frame", "repetitions", "entries"), "Int64")
    write_table(table.astype(whole), rungs.path)
    methods, limit, reduced = settings.noise_methods, settings.blowup_extent, []
    with write_hdf5(noise_runs.path) as file:
        if settings.own_noise is not None:
            reduced = noisy_runs(short.scene, runs.group, settings.own_noise, methods, limit, file)
    table = pd.DataFrame([{**labels, **row} for row in reduced], columns=NOISE_COLUMNS)
    write_table(table.astype({"frames": "Int64", "blowup_frame": "Int64"}), noise.path)


def _ladder(runs: ReducedRuns, short: ReducedRuns, ladder: Ladder) -> Iterator[dict[str, Any]]:
    """Rows of every rung; ``short`` are those of the ``runs`` that are repeated."""
    data = runs.data
    for direction, method, seed, r in ladder.rungs(data.rows_per_element):
        rung = method.title if seed is None else f"signs {seed}"
        row = {"direction": direction, "rung": rung, "r": r}
        row["rows_per_element"] = data.rows_per_element
        basis = runs.basis(method, signs=seed)
        if direction == "square" and r > basis.rank:
            continue
        size = min(r, basis.rank)
        # a group that is round-off has no reduction
        for reduction in reductions(basis, method, [size] if size else []).values():
            outcome = runs.run(reduction)
            row |= {**outcome.row(runs.displacement), "r": size, **_measures(reduction, data)}
            row["relative_error_within_horizon"] = runs.error(outcome)
            repeated = runs.scene.config.name in ladder.repeated
            if repeated and seed is None and direction != "square":
                row |= _ranges(list(short.repeat(method, [size], "training", ladder)))
        yield row
        log.info("%s, %s", direction, rung)


def _measures(reduction: Reduction, data: SnapshotSet) -> dict[str, Any]:
    errors = {}
    for split in SPLITS:
        p = getattr(data, split)
        errors[f"error_{split}"] = relative_errors(p, reduction.reconstruct(p), data.roundoff)[0]
    entries = sum(len(block.entries) for block in reduction.blocks)
    return {"entries": entries, "condition": reduction.condition, "gain": reduction.gain, **errors}


def _ranges(runs: list[Repetition]) -> dict[str, Any]:
    """Ranges over the repetitions; a run that ended before the horizon has an infinite error."""
    if not runs:
        return {}
    errors, gains = [run.error for run in runs], [run.gain for run in runs]
    return {
        "repetitions": len(runs),
        "error_median": float(np.median(errors)),
        "error_low": min(errors),
        "error_high": max(errors),
        "gain_low": min(gains),
        "gain_high": max(gains),
    }
