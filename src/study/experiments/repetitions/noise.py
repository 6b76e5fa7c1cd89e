"""Run models with bases computed from projections that are only rounding errors."""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Annotated

import h5py
import numpy as np
from pydantic import Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import Scene
from pdrom.reduction import snapshots as sets
from pdrom.reduction.basis import group_basis
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.sampling import reductions
from pdrom.reduction.sampling.model import ProjectionModel
from study.experiments.kit import base as kit
from study.experiments.kit.runs import Row, run, store_end

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "noisy_axes", "seed", "method", "r", "rank", "gain", "frames", "finite",
    "blowup_frame", "relative_error",
]  # fmt: skip
ALL, PLANE, VERTEX = "all", "plane", "vertex"
SIZE = 1e-15  # displacement of vertices (rounding errors), relative to the mesh's longest side
Runs = list[tuple[Row, Rerun | None]]  # pairs (table row, run); equal initial positions
Methods = dict[str, MethodSpec]


class NoiseRuns(ConfigModel):
    """Settings of runs with bases computed from projections that are only rounding errors.

    ``sizes`` are numbers of modes; ``repetitions`` is the number of randomly displaced starts.
    """

    sizes: Annotated[tuple[kit.Modes, ...], Field(min_length=1)] = (6, 10, 20)
    repetitions: kit.Repeats = 20


class Noise(NoiseRuns):
    """Section ``noise`` of the configuration; ``cases``: scene -> its group that is reduced.

    Scenes that are not in the study are ignored.
    """

    cases: dict[str, str] = Field(default_factory=dict)
    methods: tuple[str, ...] = ("deim-joint", "published")


def noisy_runs(
    scene: Scene, group: str, asked: NoiseRuns, methods: Methods, file: h5py.File
) -> list[Row]:
    """Run full-order models from perturbed starts, and reduced models with bases of these runs.

    Returns a row for each run with the ``group`` reduced by one of ``methods``. For each of the
    `kinds` of perturbed starts, ``file`` gets the reduced runs from one start, an HDF5 group each:
    the first start from which only some runs of a method blow up (`irregular`), else the first one.
    A size r above the rank is not run: it has no results, and its HDF5 group is ``marked``.
    """
    rows = []
    for axes in kinds(scene):
        kept: Runs = []
        for seed in range(1, asked.repetitions + 1):
            start = roundoff_field(scene, axes, SIZE, seed=seed)
            found = list(_noisy(scene, group, start, asked.sizes, methods))
            rows += [{"noisy_axes": axes, "seed": seed, **row} for row, _ in found]
            if not kept or (irregular(found) and not irregular(kept)):
                kept = found
        for row, outcome in kept:
            store = file.create_group(f"{axes}/{row['method']}/r{row['r']:04d}")
            store_end(store, outcome, row["r"])
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
    """Return the kinds of perturbed starts of ``scene``, by the coordinates that are perturbed.

    The first kind perturbs all coordinates. For a flat mesh, the second kind perturbs coordinates
    in its plane only, and the third kind also the normal coordinate of a single vertex.
    """
    return (ALL, PLANE, VERTEX) if np.ptp(scene.mesh.points, axis=0).min() == 0.0 else (ALL,)


def roundoff_field(scene: Scene, axes: str, size: float, seed: int) -> np.ndarray:
    """Draw a random displacement (N, 3) m; ``axes`` is the kind of perturbed start (`kinds`).

    Every vertex moves by ``size`` times the longest side of the mesh; then displacements that the
    kind does not allow are set to 0. ``seed`` draws directions and, for kind `VERTEX`, the vertex.
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
    scene: Scene, name: str, start: np.ndarray, sizes: Sequence[int], methods: Methods
) -> Iterator[tuple[Row, Rerun | None]]:
    """Yield (row, run) of all reductions, with initial positions displaced by ``start`` (N, 3) m.

    The run is None at a size above the rank. The reductions are trained on projections of the
    full-order run from this start, and no mode is removed even if it consists of rounding errors.
    If a method has a system of equations for each axis, axes in which nothing moves have one, too,
    as published; in all other runs of the study, they have none.
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
            row = {"method": method, "r": r, "rank": basis.rank}
            if r in made:
                yield run(full, ProjectionModel(name, made[r]), row | {"gain": made[r].gain})
            else:
                yield row | {"frames": 0}, None
