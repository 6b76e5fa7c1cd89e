"""Position subspaces with full projections, with sampled elements and with those of hrpd."""

import logging
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from pdrom.core.names import SceneName
from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.energy import largest
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.hrpd import HrpdSpec, SampledSpace, hrpd, sampled_space
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import (
    ECSW,
    Samples,
    SubspaceModel,
    ecsw_name,
    make_columns,
    sample_elements,
)
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
FULL, HRPD = "full", "hrpd"

Sampled = Mapping[str, Samples | Interpolation]


class Hrpd(HrpdSpec):
    """Sampled constraints with interpolation, and the numbers of modes k that have them."""

    sizes: tuple[Modes, ...] = ()


class SubspaceModels(ConfigModel):
    """Position subspaces: kinds of basis, numbers of modes, tolerances of the sampling, its norm.

    ``hrpd`` adds models with interpolated projections; None leaves them out.
    """

    bases: tuple[PositionBasis, ...] = ("pod", "skinning")
    sizes: tuple[Modes, ...] = (10, 20, 40)
    tolerances: tuple[Tolerance, ...] = (3e-2, 1e-2, 1e-3)
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
    spaces: dict[str, SampledSpace | None] = {}
    if settings.hrpd is not None:
        points = scene.mesh.points
        spaces = {g.name: sampled_space(g, points, settings.hrpd) for g in scene.groups}
    for kind in settings.bases:
        for k in settings.sizes:
            columns = make_columns(scene, training, kind, k=k)
            own = spaces if HRPD in settings.methods(kind, k) else {}
            models = _samplings(scene, columns, kind, settings, own)
            yield f"{kind}_k{k:03d}", columns, kind, k, models


def _samplings(
    scene: Scene,
    columns: Columns,
    kind: str,
    settings: SubspaceModels,
    spaces: Mapping[str, SampledSpace | None],
) -> Iterator[tuple[str, Sampled]]:
    """(method, samples) pairs: full projections, element sampling on the snapshot basis, hrpd.

    The ``spaces`` of projections of each group are those of hrpd; without any it is left out.
    """
    yield FULL, {}
    if kind == "pod":
        tolerances = settings.tolerances
        frames = training_indices(scene)
        found = sample_elements(scene, columns, frames, tolerances=tolerances, norm=settings.norm)
        for tolerance, samples in zip(tolerances, found, strict=True):
            yield ecsw_name(tolerance), samples
    if spaces:
        yield HRPD, {g.name: hrpd(g, columns, spaces[g.name]) for g in scene.groups}


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
