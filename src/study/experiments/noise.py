"""Reductions of a group whose projections are round-off, on bases of that noise."""

import logging
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Annotated, Any

import h5py
import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import Basis, compute_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun, displacement_norms
from pdrom.reduction.sampling import reductions
from pdrom.reduction.sampling.local_step import rerun_reduced
from pdrom.reduction.snapshots import row_masses, training_frames
from study.artifact.paths import MESH, NOISE, NOISE_RUNS, SENSITIVITY, File
from study.artifact.reads import Settings
from study.experiments.kit.declaration import experiment
from study.experiments.kit.scenes import scene_of
from study.experiments.kit.settings import BlowupExtent, Horizon, Modes
from study.experiments.sensitivity import perturbation_field

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "noisy_axes", "seed", "method", "r", "rank", "gain", "frames", "finite",
    "blowup_frame", "relative_error",
]  # fmt: skip
ALL, PLANE, VERTEX = "all", "plane", "vertex"
Runs = list[tuple[dict[str, Any], Rerun | None]]  # rows of one start, and its runs


class NoiseRuns(ConfigModel):
    """Runs on bases of round-off.

    sizes : numbers of modes
    repetitions : starts, each with another round-off
    perturbation : length by which they move a vertex, over the extent: a few units of round-off
    """

    sizes: Annotated[tuple[Modes, ...], Field(min_length=1)] = (6, 10, 20)
    repetitions: Annotated[int, Field(ge=1, le=1000)] = 20
    perturbation: Annotated[float, Field(gt=0.0, le=1e-12)] = 1e-15


class Noise(NoiseRuns):
    """Section ``noise``: ``cases`` are scenes with a group each, as far as the study holds them."""

    cases: dict[str, str] = Field(default_factory=dict)
    methods: tuple[str, ...] = ("deim-joint", "published")


class Options(ConfigModel):
    """Settings of the runs of a scene."""

    scene: SceneConfig
    noise: NoiseRuns
    noise_methods: dict[str, MethodSpec]
    horizon: Horizon
    blowup_extent: BlowupExtent


@experiment(
    "Bases of the round-off of {group} in {scene}",
    reads={"mesh": MESH, "sensitivity": SENSITIVITY, "settings": Settings(Options)},
    writes={"out": NOISE, "runs": NOISE_RUNS},
)
def noise(mesh: File, sensitivity: File, settings: Options, out: File, runs: File) -> None:
    """Perturb, run, make bases without a cutoff, rerun; up to the scene's horizon."""
    labels, asked = out.labels, settings.noise
    whole = scene_of(settings.scene, mesh)
    frames = min(whole.config.frames, max(2, settings.horizon.frames(sensitivity)))
    scene = whole.changed(frames=frames)
    rows = []
    with write_hdf5(runs.path) as file:
        for axes in kinds(scene):
            kept: Runs = []
            for seed in range(1, asked.repetitions + 1):
                found = list(_runs(scene, labels["group"], axes, seed, settings))
                rows += [{**labels, "noisy_axes": axes, "seed": seed, **row} for row, _ in found]
                if not kept or (irregular(found) and not irregular(kept)):
                    kept = found
            for row, outcome in kept:
                store = file.create_group(f"{axes}/{row['method']}/r{row['r']:04d}")
                _store(store, row["r"], outcome)
            log.info("%s: %d starts", axes, asked.repetitions)
    whole_numbers = dict.fromkeys(("frames", "blowup_frame"), "Int64")
    write_table(pd.DataFrame(rows, columns=COLUMNS).astype(whole_numbers), out.path)


def irregular(runs: Runs) -> bool:
    """Whether a method runs at some sizes and blows up at others."""
    ends: dict[str, set[bool]] = {}
    for row, outcome in runs:
        if outcome is not None:
            ends.setdefault(row["method"], set()).add(outcome.finite)
    return any(len(seen) > 1 for seen in ends.values())


def kinds(scene: Scene) -> tuple[str, ...]:
    """Names of the sets of coordinates of ``scene`` that a start perturbs.

    Of a flat mesh, too, those of its plane alone, and these with the axis across it at a single
    vertex.
    """
    return (ALL, PLANE, VERTEX) if np.ptp(scene.mesh.points, axis=0).min() == 0.0 else (ALL,)


def roundoff_field(scene: Scene, axes: str, size: float, seed: int) -> np.ndarray:
    """Displacement (N, 3) m of a start, zero where ``axes`` of `kinds` say.

    ``scene``, ``size`` and ``seed`` as in `perturbation_field`; the seed draws the vertex, too.
    """
    field = perturbation_field(scene, size, seed)
    if axes != ALL:
        still = np.ones(len(field), dtype=bool)
        if axes == VERTEX:
            moved = np.flatnonzero(field.any(axis=1))
            still[np.random.default_rng(seed).choice(moved)] = False
        field[np.ix_(still, np.ptp(scene.mesh.points, axis=0) == 0.0)] = 0.0
    return field


def noise_basis(
    projections: np.ndarray, row_mass: np.ndarray, rows_per_element: int, method: MethodSpec
) -> Basis:
    """Basis of all that is stored, be it round-off: no cutoff, and no axis is left out.

    A method with separate systems then has one for an axis in which nothing moves, as its text
    says; elsewhere in this study such an axis has none.

    Parameters
    ----------
    projections : (n, e p, 3) snapshots
    row_mass, rows_per_element : see `compute_basis`
    """
    basis = compute_basis(
        projections, row_mass, 0.0, rows_per_element=rows_per_element, spec=method
    )
    return replace(basis, active_axes=(True, True, True))


def _full_order(
    scene: Scene, look: Callable[[np.ndarray], np.ndarray], start: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (F + 1, N, 3) of a run, and ``look`` at the last iterates of its frames (F, ...).

    ``start`` (N, 3) m is added to the initial positions.
    """
    loop, state = scene.stepper(), scene.initial_state(start)
    positions, seen = [state.positions], []
    for frame in range(scene.config.frames):
        state, _ = loop.step(state, frame, lambda y: seen.append(look(y)))
        positions.append(state.positions)
    return np.stack(positions), np.stack(seen)


def _runs(
    scene: Scene, name: str, axes: str, seed: int, settings: Options
) -> Iterator[tuple[dict[str, Any], Rerun | None]]:
    """Rows and runs of one start: its full-order run, then the reductions trained on it."""
    group, plan = scene.group(name), scene.config.reduce[name]
    start = roundoff_field(scene, axes, settings.noise.perturbation, seed=seed)
    reference, projections = _full_order(scene, group.project, start)
    even = training_frames(scene.config.frames, min(plan.train, (scene.config.frames + 1) // 2))
    masses = row_masses(group, scene.masses)
    displacement = displacement_norms(reference)
    for method, spec in settings.noise_methods.items():
        basis = noise_basis(projections[even], masses, group.rows_per_element, method=spec)
        made = reductions(basis, spec, settings.noise.sizes)
        for r in settings.noise.sizes:
            row = {"method": method, "r": r, "rank": basis.rank, "frames": 0}
            outcome = None
            if r in made:
                outcome = rerun_reduced(
                    scene, name, made[r], reference, blowup_extent=settings.blowup_extent
                )
                row |= {"gain": made[r].gain, **outcome.row(displacement)}
            yield row, outcome


def _store(store: h5py.Group, r: int, outcome: Rerun | None) -> None:
    """A run in the layout of `study.experiments.reruns`; marked where r exceeds the rank."""
    store.attrs.update(r=r, marked=outcome is None)
    if outcome is not None:
        blowup = -1 if outcome.blowup_frame is None else outcome.blowup_frame
        store.attrs.update(blowup_frame=blowup, max_extent=outcome.max_extent)
        store["positions"] = outcome.positions.astype(np.float32)
