"""Position subspaces with full projections, with sampled elements and with interpolation."""

import logging
from collections import defaultdict
from collections.abc import Iterator, Mapping
from itertools import chain
from typing import Any

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.names import SceneName
from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.energy import largest
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.hrpd import hrpd, sampled_space
from pdrom.reduction.subspace.interpolated import Training, interpolate
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import (
    ECSW,
    Samples,
    SubspaceModel,
    ecsw_name,
    make_columns,
    sample_elements,
)
from pdrom.reduction.subspace.specs import HrpdSpec, InterpolationSpec
from pdrom.reduction.subspace.store import store_columns, store_model
from pdrom.reduction.subspace.training import Norm
from study.artifact.paths import (
    FULL_ORDER,
    MESH,
    SUBSPACES,
    SUBSPACES_HELDOUT,
    SUBSPACES_SECONDS,
    SUBSPACES_TRAIN,
    File,
)
from study.artifact.reads import Every, Settings
from study.experiments.kit.declaration import experiment
from study.experiments.kit.measurement import clocked
from study.experiments.kit.motion import Motion, training_indices, training_positions
from study.experiments.kit.scenes import TRAIN, scene_of
from study.experiments.kit.settings import BlowupExtent, Modes, PositionBasis, Tolerance

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "position_basis", "k", "r", "frames", "finite", "blowup_frame",
    "max_extent", "relative_error", "energy_ratio",
]  # fmt: skip

SECONDS_COLUMNS = ["scene", "position_basis", "k", "method", "reduction_s"]
FULL = "full"

Sampled = Mapping[str, Samples | Interpolation]


class SubspaceModels(ConfigModel):
    """Position subspaces: kinds of basis, numbers of modes, tolerances of the sampling, its norm.

    At the ``interpolated_sizes`` the projections are interpolated, too: by ``hrpd`` (None leaves it
    out), and on the snapshot basis by every method of ``interpolations``.
    """

    bases: tuple[PositionBasis, ...] = ("pod", "skinning")
    sizes: tuple[Modes, ...] = (10, 20, 40)
    tolerances: tuple[Tolerance, ...] = (3e-2, 1e-2, 1e-3)
    norm: Norm = "energy"
    interpolated_sizes: tuple[Modes, ...] = ()
    hrpd: HrpdSpec | None = None
    interpolations: dict[str, InterpolationSpec] = Field(default_factory=dict)

    def methods(self, kind: str, k: int) -> list[str]:
        """Names of the models on a basis of ``kind`` with k modes."""
        if kind not in self.bases or k not in self.sizes:
            return []
        trained = kind == "pod"
        names = [FULL, *(ecsw_name(tolerance) for tolerance in self.tolerances if trained)]
        if k in self.interpolated_sizes:
            names += ["hrpd"] if self.hrpd is not None else []
            names += list(self.interpolations) if trained else []
        return names


class Subspace(SubspaceModels):
    """Section ``subspace``: the models, and the ``scenes`` that have them (all if empty)."""

    scenes: tuple[SceneName, ...] = ()


class Options(ConfigModel):
    """Settings of the position subspaces of a scene."""

    scene: SceneConfig
    subspace: SubspaceModels
    blowup_extent: BlowupExtent


@experiment(
    "Position subspaces of {scene}, with full and with sampled projections",
    reads={"mesh": MESH, "full_order": Every(FULL_ORDER), "settings": Settings(Options)},
    writes={
        "out": SUBSPACES,
        "train_table": SUBSPACES_TRAIN,
        "heldout_table": SUBSPACES_HELDOUT,
        "seconds_table": SUBSPACES_SECONDS,
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
        run["run"]: Motion(scene_of(settings.scene, mesh, run["run"]), run) for run in full_order
    }
    rows: dict[str, list[dict[str, Any]]] = {name: [] for name in motions}
    seconds = []
    with write_hdf5(out.path) as file:
        for name, motion in motions.items():
            for series, values in motion.series.items():
                file[f"{series}/{name}"] = values
        start = motions[TRAIN]
        file.attrs.update(start.units)
        made = clocked(_subspaces(start, settings.subspace))
        for of_columns, (base, columns, kind, k, models) in made:
            store_columns(file.create_group(f"columns/{base}"), columns)
            spent: dict[str, float] = defaultdict(float)
            for of_model, (method, samples) in clocked(models):
                # samplings of all tolerances are made together, for the first of them
                family = ECSW if method.startswith(ECSW) else method
                spent[family] += of_model
                seconds.append(
                    (start.scene.config.name, kind, k, method, of_columns + spent[family])
                )
                model = SubspaceModel(kind, columns, samples)
                labels = {"method": method, "position_basis": kind, "k": k, "base": base}
                store = file.create_group(f"models/{base}_{method}")
                store_model(store, labels, samples)
                for name, motion in motions.items():
                    outcome = motion.run(model, settings.blowup_extent)
                    seen = motion.deviations(outcome)
                    kept = {"coordinates": outcome.coordinates, "extent": outcome.extent, **seen}
                    for series, values in kept.items():
                        store[f"{name}/{series}"] = values
                    energy = largest(seen["energy"])
                    rows[name].append(_row(motion, labels, model, outcome, energy))
                log.info("%s %s: error %s", base, method, rows[TRAIN][-1]["relative_error"])
    tables = {name: pd.DataFrame(own, columns=COLUMNS) for name, own in rows.items()}
    write_table(tables.pop(TRAIN), train_table.path)
    heldout = [table.assign(motion=name) for name, table in tables.items()]
    write_table(pd.concat(heldout, ignore_index=True), heldout_table.path)
    write_table(pd.DataFrame(seconds, columns=SECONDS_COLUMNS), seconds_table.path)


def _subspaces(
    motion: Motion, settings: SubspaceModels
) -> Iterator[tuple[str, Columns, str, int, Iterator[tuple[str, Sampled]]]]:
    """Name, columns, kind and size of every subspace, with the models in it."""
    scene, training = motion.scene, training_positions(motion)
    spaces = _sampled_spaces(scene, settings.hrpd)
    for kind in settings.bases:
        for k in settings.sizes:
            columns = make_columns(scene, training, kind, k=k)
            models = _samplings(scene, columns, kind, settings)
            if k in settings.interpolated_sizes:
                more = _interpolations(scene, columns, training, kind, settings, spaces)
                models = chain(models, more)
            yield f"{kind}_k{k:03d}", columns, kind, k, models


def _samplings(
    scene: Scene, columns: Columns, kind: str, settings: SubspaceModels
) -> Iterator[tuple[str, Sampled]]:
    """(method, samples) pairs: full projections, and element sampling on the snapshot basis."""
    yield FULL, {}
    if kind == "pod":
        tolerances = settings.tolerances
        frames = training_indices(scene)
        found = sample_elements(scene, columns, frames, tolerances=tolerances, norm=settings.norm)
        for tolerance, samples in zip(tolerances, found, strict=True):
            yield ecsw_name(tolerance), samples


def _sampled_spaces(scene: Scene, spec: HrpdSpec | None) -> dict[str, Any]:
    """Spaces of projections for hrpd, by group; they depend on the rest shape only."""
    if spec is None:
        return {}
    return {group.name: sampled_space(group, scene.mesh.points, spec) for group in scene.groups}


def _interpolations(
    scene: Scene,
    columns: Columns,
    training: np.ndarray,
    kind: str,
    settings: SubspaceModels,
    spaces: dict[str, Any],
) -> Iterator[tuple[str, Sampled]]:
    """(method, interpolations) pairs: hrpd, and the trained ones on the snapshot basis."""
    if spaces:
        yield "hrpd", {g.name: hrpd(g, columns, spaces[g.name]) for g in scene.groups}
    if kind == "pod":
        states = Training(scene, columns, training)
        for method, spec in settings.interpolations.items():
            yield method, interpolate(scene, columns, states, spec=spec)


def _row(
    motion: Motion,
    labels: dict[str, Any],
    model: SubspaceModel,
    outcome: Rerun,
    energy: float | None,
) -> dict[str, Any]:
    scene = motion.scene
    return {
        "scene": scene.config.name,
        "group": "all",
        **labels,
        "r": model.elements_evaluated(scene),
        "frames": outcome.frames,
        "finite": outcome.finite,
        "blowup_frame": outcome.blowup_frame,
        "max_extent": outcome.max_extent,
        "relative_error": outcome.error(motion.displacement),
        "energy_ratio": energy,
    }
