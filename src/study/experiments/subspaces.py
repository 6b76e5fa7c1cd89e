"""Position subspaces with full projections, with sampled elements and with those of hrpd.

The models of a large scene are made and run in one job with its full-order runs, which no other job
reads; `study.experiments.frame_times` times them.
"""

import logging
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.energy import largest
from pdrom.model.held_out import MOTIONS
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.snapshots import training_frames
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.ecsw import Norm
from pdrom.reduction.subspace.hrpd import HrpdSpec, SampledSpace, hrpd, sampled_space
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import (
    ECSW,
    Samples,
    SubspaceModel,
    ecsw_name,
    make_columns,
    rerun_model,
    sample_elements,
    store_columns,
    store_model,
)
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Settings, SourcesOf
from study.experiments.kit.declaration import experiment
from study.experiments.kit.measurement import clocked
from study.experiments.kit.scenes import TRAIN, positions_of, scene_of
from study.experiments.kit.settings import BlowupExtent, Modes, PositionBasis, Tolerance

log = logging.getLogger(__name__)

_RUN = [
    "scene", "group", "method", "position_basis", "k", "r", "frames", "finite", "blowup_frame",
    "max_extent", "relative_error",
]  # fmt: skip
COLUMNS = [*_RUN, "energy_ratio"]
_MADE = [*COLUMNS, "motion", "reduction_s"]
SECONDS_COLUMNS = ["scene", "position_basis", "k", "method", "reduction_s"]
LARGE_COLUMNS = [*_RUN, "motion", "tau", "vertices", "elements", "iterations", "reduction_s"]
FULL, HRPD = "full", "hrpd"

Sampled = Mapping[str, Samples | Interpolation]


class Motion(Yardstick):
    """A motion of a scene with its full-order run."""

    def run(self, model: SubspaceModel, limit: float) -> Rerun:
        """Run a model; a blow-up, an extent above ``limit`` m, ends the run and is recorded."""
        return rerun_model(self.scene, model, self.reference, blowup_extent=limit)


class Hrpd(HrpdSpec):
    """Sampled constraints with interpolation, and the numbers of modes k that have them."""

    sizes: tuple[Modes, ...] = ()


class SubspaceModels(ConfigModel):
    """Position subspaces: kinds of basis, numbers of modes, tolerances of the sampling, its norm.

    ``hrpd`` adds models with interpolated projections; None leaves them out.
    """

    bases: tuple[PositionBasis, ...] = ("pod", "skinning")
    sizes: tuple[Modes, ...] = (10, 40)
    tolerances: tuple[Tolerance, ...] = (3e-2, 1e-2)
    norm: Norm = "energy"
    hrpd: Hrpd | None = None

    def methods(self, kind: str, k: int) -> list[str]:
        """Names of the models on a basis of ``kind`` with k modes."""
        if kind not in self.bases or k not in self.sizes:
            return []
        tolerances = self.tolerances if kind == "pod" else ()
        interpolated = self.hrpd is not None and k in self.hrpd.sizes
        return [FULL, *map(ecsw_name, tolerances), *([HRPD] if interpolated else [])]


class Subspace(SubspaceModels):
    """Section ``subspace``: the models, and the ``scenes`` that have them (all if empty)."""

    scenes: tuple[SceneName, ...] = ()


class LargeModels(SubspaceModels):
    """Models of a large scene; none evaluates all projections, which takes too long."""

    bases: tuple[PositionBasis, ...] = ("pod",)
    sizes: tuple[Modes, ...] = (20,)
    tolerances: tuple[Tolerance, ...] = (1e-2,)

    def methods(self, kind: str, k: int) -> list[str]:
        """Names of the models on a basis of ``kind`` with k modes."""
        return [method for method in super().methods(kind, k) if method != FULL]


class Online(LargeModels):
    """Section ``online``: the models, and the large ``scenes`` that are reduced by them."""

    scenes: tuple[str, ...] = ()


class Options(ConfigModel):
    """Settings of the position subspaces of a scene."""

    scene: SceneConfig
    subspace: SubspaceModels
    blowup_extent: BlowupExtent


class LargeOptions(ConfigModel):
    """Settings of the position subspaces of a large scene."""

    scene: SceneConfig
    online: LargeModels
    blowup_extent: BlowupExtent


@experiment(
    "Position subspaces of {scene}, with full and with sampled projections",
    reads={
        "mesh": paths.MESH,
        "full_order": Every(paths.FULL_ORDER),
        "settings": Settings(Options),
    },
    writes={
        "out": paths.SUBSPACES,
        "train_table": paths.SUBSPACES_TRAIN,
        "heldout_table": paths.SUBSPACES_HELDOUT,
        "seconds_table": paths.SUBSPACES_SECONDS,
    },
)
def subspaces(
    mesh: File,
    full_order: list[File],
    settings: Options,
    out: File,
    train_table: File,
    heldout_table: File,
    seconds_table: File,
) -> None:
    """Build every model (bases, sizes, tolerances) and run all motions with it."""
    motions = {
        run["run"]: Motion(scene_of(settings.scene, mesh, run["run"]), positions_of(run))
        for run in full_order
    }
    with write_hdf5(out.path) as file:
        for name, motion in motions.items():
            for series, values in motion.series.items():
                file[f"{series}/{name}"] = values
        file.attrs.update(motions[TRAIN].units)
        runs = _Runs(file, settings.blowup_extent, compared=True)
        rows = runs.of_models(motions, settings.subspace)
    train = rows.pop(TRAIN)
    write_table(train[COLUMNS], train_table.path)
    heldout = pd.concat(rows.values(), ignore_index=True)
    write_table(heldout[[*COLUMNS, "motion"]], heldout_table.path)
    write_table(train[SECONDS_COLUMNS], seconds_table.path)


@experiment(
    "Reduction of {scene}",
    reads={"sources": SourcesOf("scene.mesh"), "settings": Settings(LargeOptions)},
    writes={"out": paths.ONLINE, "models": paths.ONLINE_MODELS},
)
def online(sources: list[Path], settings: LargeOptions, out: File, models: File) -> None:
    """Reduce a large scene by every model and run all motions with each.

    Its mesh is made of the ``sources``, its full-order runs are made here and not kept.
    """
    config, mesh = settings.scene, settings.scene.mesh.build(Path())
    variants = {TRAIN: config} | {str(name): config.heldout_variant(name) for name in MOTIONS}
    scenes = {name: Scene.build(variant, mesh) for name, variant in variants.items()}
    motions = {
        name: Motion(scene, trajectory(scene, track_objective=False))
        for name, scene in scenes.items()
    }
    log.info("%s: full-order runs of %d vertices", config.name, mesh.vertices)
    with write_hdf5(models.path) as file:
        runs = _Runs(file, settings.blowup_extent, compared=False)
        rows = runs.of_models(motions, settings.online)
    table = pd.concat(rows.values(), ignore_index=True)
    tolerances = {ecsw_name(tolerance): tolerance for tolerance in settings.online.tolerances}
    table = table.assign(
        tau=table.method.map(tolerances),
        vertices=mesh.vertices,
        elements=sum(group.elements for group in scenes[TRAIN].groups),
        iterations=config.iterations,
    )
    write_table(table[LARGE_COLUMNS], out.path)


class _Runs:
    """Runs of all motions of a scene with every model, which is stored in a file.

    limit : extent of a blow-up over that of the rest shape
    compared : whether the file receives coordinates and deviations of each run, too
    """

    def __init__(self, file: h5py.File, limit: float, compared: bool) -> None:
        self._file, self._limit, self._compared = file, limit, compared

    def of_models(
        self, motions: Mapping[str, Motion], settings: SubspaceModels
    ) -> dict[str, pd.DataFrame]:
        """Rows of each motion: every model of ``settings``, trained on the training motion."""
        rows: dict[str, list[dict[str, Any]]] = {name: [] for name in motions}
        made = clocked(_subspaces(motions[TRAIN], settings))
        for of_columns, (base, columns, kind, k, models) in made:
            store_columns(self._file.create_group(f"columns/{base}"), columns)
            spent: dict[str, float] = defaultdict(float)
            for of_model, (method, samples) in clocked(models):
                # one call samples for all tolerances: it is made at the first of them
                family = ECSW if method.startswith(ECSW) else method
                spent[family] += of_model
                model = SubspaceModel(kind, columns, samples)
                labels: dict[str, Any] = {"method": method, "position_basis": kind, "k": k}
                store = self._file.create_group(f"models/{base}_{method}")
                store_model(store, {**labels, "base": base}, samples)
                labels |= {"group": "all", "reduction_s": of_columns + spent[family]}
                for name, motion in motions.items():
                    outcome = motion.run(model, self._limit)
                    row = outcome.row(motion.displacement) | labels | {"motion": name}
                    row["scene"] = motion.scene.config.name
                    row["r"] = model.elements_evaluated(motion.scene)
                    if self._compared:
                        row["energy_ratio"] = _store_run(store, name, motion, outcome)
                    rows[name].append(row)
                log.info("%s %s: error %s", base, method, rows[TRAIN][-1]["relative_error"])
        return {name: pd.DataFrame(own, columns=_MADE) for name, own in rows.items()}


def _store_run(store: h5py.Group, name: str, motion: Motion, outcome: Rerun) -> float | None:
    """Store an ``outcome`` of the motion ``name``; its largest energy over the full order's."""
    seen = motion.deviations(outcome)
    kept = {"coordinates": outcome.coordinates, "extent": outcome.extent, **seen}
    for series, values in kept.items():
        store[f"{name}/{series}"] = values
    return largest(seen["energy"])


def _subspaces(
    motion: Motion, settings: SubspaceModels
) -> Iterator[tuple[str, Columns, str, int, Iterator[tuple[str, Sampled]]]]:
    """Name, columns, kind and size of every subspace, with the models in it."""
    scene, training = motion.scene, training_positions(motion)
    spaces: dict[str, SampledSpace | None] = {}
    if settings.hrpd is not None:
        points = scene.mesh.points
        spaces = {g.name: sampled_space(g, points, settings.hrpd) for g in scene.groups}
    for kind in settings.bases:
        for k in settings.sizes:
            columns = make_columns(scene, training, kind, k=k)
            models = _samplings(scene, columns, settings.methods(kind, k), settings, spaces)
            yield f"{kind}_k{k:03d}", columns, kind, k, models


def _samplings(
    scene: Scene,
    columns: Columns,
    methods: list[str],
    settings: SubspaceModels,
    spaces: Mapping[str, SampledSpace | None],
) -> Iterator[tuple[str, Sampled]]:
    """(method, samples) pairs of the ``methods``; ``spaces`` of projections are those of hrpd."""
    if FULL in methods:
        yield FULL, {}
    if any(method.startswith(ECSW) for method in methods):
        tolerances = settings.tolerances
        frames = training_indices(scene)
        found = sample_elements(scene, columns, frames, tolerances=tolerances, norm=settings.norm)
        for tolerance, samples in zip(tolerances, found, strict=True):
            yield ecsw_name(tolerance), samples
    if HRPD in methods:
        yield HRPD, {g.name: hrpd(g, columns, spaces[g.name]) for g in scene.groups}


def training_indices(scene: Scene) -> np.ndarray:
    """Training frames (n,) of ``scene``: the even ones that train the projections, too."""
    count = max(plan.train for plan in scene.config.reduce.values())
    return training_frames(scene.config.frames, count)


def training_positions(motion: Motion) -> np.ndarray:
    """Positions (n, N, 3) m of ``motion`` after the training frames."""
    return motion.reference[1:][training_indices(motion.scene)]
