"""Reductions of a group whose projections are round-off, on bases of that noise."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any

import h5py
import numpy as np
from pydantic import Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import Scene
from pdrom.reduction.basis import Basis, compute_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun, displacement_norms
from pdrom.reduction.sampling import reductions
from pdrom.reduction.sampling.local_step import rerun_reduced
from pdrom.reduction.snapshots import row_masses, training_frames
from study.experiments.kit.reruns import store_end
from study.experiments.kit.scenes import perturbation_field
from study.experiments.kit.settings import Modes

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


def noisy_runs(
    scene: Scene,
    group: str,
    asked: NoiseRuns,
    methods: Mapping[str, MethodSpec],
    blowup_extent: float,
    file: h5py.File,
) -> list[dict[str, Any]]:
    """Perturb the start of ``scene``, run, make bases without a cutoff, rerun.

    Returned are the rows of all runs with the ``group`` reduced by each of ``methods``. The runs of
    one start of each kind go to ``file``, in the layout of `study.experiments.reruns`; marked where
    r exceeds the rank.
    """
    rows = []
    for axes in kinds(scene):
        kept: Runs = []
        for seed in range(1, asked.repetitions + 1):
            start = roundoff_field(scene, axes, asked.perturbation, seed=seed)
            found = list(_runs(scene, group, start, asked.sizes, methods, blowup_extent))
            rows += [{"noisy_axes": axes, "seed": seed, **row} for row, _ in found]
            if not kept or (irregular(found) and not irregular(kept)):
                kept = found
        for row, outcome in kept:
            store = file.create_group(f"{axes}/{row['method']}/r{row['r']:04d}")
            store.attrs.update(r=row["r"], marked=outcome is None)
            if outcome is not None:
                store_end(store, outcome)
        log.info("%s: %d starts", axes, asked.repetitions)
    return rows


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


def _runs(
    scene: Scene,
    name: str,
    start: np.ndarray,
    sizes: Sequence[int],
    methods: Mapping[str, MethodSpec],
    blowup_extent: float,
) -> Iterator[tuple[dict[str, Any], Rerun | None]]:
    """Rows and runs from one ``start`` (N, 3) m, which is added to the initial positions.

    The reductions are trained on its full-order run.
    """
    group, plan, frames = scene.group(name), scene.config.reduce[name], scene.config.frames
    loop, state = scene.stepper(), scene.initial_state(start)
    positions, projections = [state.positions], []
    for frame in range(frames):
        state, _ = loop.step(state, frame, lambda y: projections.append(group.project(y)))
        positions.append(state.positions)
    reference = np.stack(positions)
    even = training_frames(frames, min(plan.train, (frames + 1) // 2))
    trained_on, masses = np.stack(projections)[even], row_masses(group, scene.masses)
    displacement = displacement_norms(reference)
    for method, spec in methods.items():
        basis = noise_basis(trained_on, masses, group.rows_per_element, method=spec)
        made = reductions(basis, spec, sizes)
        for r in sizes:
            row = {"method": method, "r": r, "rank": basis.rank, "frames": 0}
            outcome = None
            if r in made:
                outcome = rerun_reduced(scene, name, made[r], reference, blowup_extent)
                row |= {"gain": made[r].gain, **outcome.row(displacement)}
            yield row, outcome
