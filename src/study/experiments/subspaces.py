"""Models in position subspaces, whose projections are full, sampled (ecsw) or interpolated (hrpd).

For a large scene, one job makes the models, runs them, and makes the full-order runs, which no
other job reads; `study.experiments.frame_times` times the models. `live` writes the models of a
scene to a file that a web page loads, to run them in the reader's browser.
"""

import json
import logging
from collections import defaultdict
from collections.abc import Iterator, Mapping
from math import ceil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd

from pdrom.core.errors import StorageError
from pdrom.core.packed import pack_array, pack_positions
from pdrom.core.store import write_hdf5, write_table, write_text
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.energy import largest
from pdrom.model.held_out import MOTIONS
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import load_basis
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import mean_motion
from pdrom.reduction.sampling import Reduction
from pdrom.reduction.snapshots import training_frames
from pdrom.reduction.subspace import exported
from pdrom.reduction.subspace import model as subspace
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.ecsw import Norm
from pdrom.reduction.subspace.hrpd import HrpdSpec, SampledSpace, hrpd, sampled_space
from pdrom.reduction.subspace.interpolation import Interpolation, interpolation_of
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import EachOf, Every, Setting, Settings, SourcesOf
from study.experiments.kit import base as kit
from study.experiments.kit import runfiles
from study.experiments.kit.base import experiment
from study.experiments.kit.measurement import clocked

log = logging.getLogger(__name__)

_RUN = [
    "scene", "group", "method", "position_basis", "k", "r", "frames", "finite", "blowup_frame",
    "max_extent", "relative_error",
]  # fmt: skip
COLUMNS = [*_RUN, "energy_ratio"]
_MADE = [*COLUMNS, "motion", "playback_error", "reduction_s"]
SECONDS_COLUMNS = ["scene", "position_basis", "k", "method", "reduction_s"]
LARGE_COLUMNS = [
    *_RUN, "motion", "playback_error", "tau", "vertices", "elements", "iterations", "reduction_s",
]  # fmt: skip
FULL, HRPD = "full", "hrpd"

Sampled = Mapping[str, subspace.Samples | Interpolation]


class Hrpd(HrpdSpec):
    """Settings of models with interpolated projections; ``sizes`` are their numbers of modes k."""

    sizes: tuple[kit.Modes, ...] = ()


class SubspaceModels(ConfigModel):
    """Settings of models in position subspaces.

    bases, sizes : kinds of basis, and numbers of modes k
    tolerances, norm : relative residuals of energy-conserving sampling (ecsw), and their norm
    hrpd : settings of models with interpolated projections; None for no such models
    """

    bases: tuple[kit.PositionBasis, ...] = ("pod", "skinning")
    sizes: tuple[kit.Modes, ...] = (10, 40)
    tolerances: tuple[kit.Tolerance, ...] = (3e-2, 1e-2)
    norm: Norm = "energy"
    hrpd: Hrpd | None = None

    def methods(self, kind: str, k: int) -> list[str]:
        """Names of the configured models on a basis of ``kind`` with k modes; empty if none."""
        if kind not in self.bases or k not in self.sizes:
            return []
        tolerances = self.tolerances if kind == "pod" else ()
        interpolated = self.hrpd is not None and k in self.hrpd.sizes
        return [FULL, *map(subspace.ecsw_name, tolerances), *([HRPD] if interpolated else [])]


class Subspace(SubspaceModels):
    """Section ``subspace``: models in position subspaces, and their ``scenes`` (empty: all)."""

    scenes: tuple[SceneName, ...] = ()


class LargeModels(SubspaceModels):
    """Settings of models of a large scene; none evaluates all elements, which takes too long."""

    bases: tuple[kit.PositionBasis, ...] = ("pod",)
    sizes: tuple[kit.Modes, ...] = (20,)
    tolerances: tuple[kit.Tolerance, ...] = (1e-2,)

    def methods(self, kind: str, k: int) -> list[str]:
        """Names of models on a basis of ``kind`` with k modes, except `FULL` (all elements)."""
        return [method for method in super().methods(kind, k) if method != FULL]


class Online(LargeModels):
    """Section ``online``: large ``scenes``, and settings of the reduced models made of them."""

    scenes: tuple[str, ...] = ()


@experiment(
    "Position subspaces of {scene}, with full and with sampled projections",
    reads={
        "mesh": paths.MESH,
        "full_order": Every(paths.FULL_ORDER),
        "config": Setting("scene"),
        "asked": Setting("subspace"),
        "blowup_extent": Setting("blowup_extent"),
    },
    writes={
        "out": paths.SUBSPACES,
        "train_table": paths.SUBSPACES_TRAIN,
        "heldout_table": paths.SUBSPACES_HELDOUT,
        "seconds_table": paths.SUBSPACES_SECONDS,
    },
)
def subspaces(
    full_order: list[File],
    config: SceneConfig,
    asked: SubspaceModels,
    blowup_extent: kit.BlowupExtent,
    **files: File,
) -> None:
    """Build a model for every basis, size and sampling, and run all motions with each."""
    motions = {
        run["run"]: Yardstick(
            kit.scene_of(config, files["mesh"], run["run"]), kit.positions_of(run)
        )
        for run in full_order
    }
    with write_hdf5(files["out"].path) as file:
        for name, motion in motions.items():
            for series, values in motion.series.items():
                file[f"{series}/{name}"] = values
        file.attrs.update(motions[kit.TRAIN].units)
        rows = _runs(file, motions, asked, blowup_extent, compared=True)
    train, heldout = rows[rows.motion == kit.TRAIN], rows[rows.motion != kit.TRAIN]
    write_table(train[COLUMNS], files["train_table"].path)
    write_table(heldout[[*COLUMNS, "motion"]], files["heldout_table"].path)
    write_table(train[SECONDS_COLUMNS], files["seconds_table"].path)


@experiment(
    "Reduction of {scene}",
    reads={
        "sources": SourcesOf("scene.mesh"),
        "config": Setting("scene"),
        "asked": Setting("online"),
        "blowup_extent": Setting("blowup_extent"),
    },
    writes={"out": paths.ONLINE, "models": paths.ONLINE_MODELS},
)
def online(
    sources: list[Path],
    config: SceneConfig,
    asked: LargeModels,
    blowup_extent: kit.BlowupExtent,
    out: File,
    models: File,
) -> None:
    """Build every model of a large scene, and run all motions with each model.

    The mesh is built here, from the files ``sources``; full-order runs are made, but not stored.
    """
    mesh = config.mesh.build(Path())
    variants = {kit.TRAIN: config} | {str(name): config.heldout_variant(name) for name in MOTIONS}
    scenes = {name: Scene.build(variant, mesh) for name, variant in variants.items()}
    motions = {
        name: Yardstick(scene, trajectory(scene, track_objective=False))
        for name, scene in scenes.items()
    }
    log.info("%s: full-order runs of %d vertices", config.name, mesh.vertices)
    with write_hdf5(models.path) as file:
        rows = _runs(file, motions, asked, blowup_extent, compared=False)
    table = rows.assign(
        tau=rows.method.map(
            {subspace.ecsw_name(tolerance): tolerance for tolerance in asked.tolerances}
        ),
        vertices=mesh.vertices,
        elements=sum(group.elements for group in scenes[kit.TRAIN].groups),
        iterations=config.iterations,
    )
    write_table(table[LARGE_COLUMNS], out.path)


def _runs(
    file: h5py.File,
    motions: Mapping[str, Yardstick],
    settings: SubspaceModels,
    limit: float,
    compared: bool,
) -> pd.DataFrame:
    """Train every model on the training motion, run all motions with it, and return the rows.

    file : file that receives the models
    limit : a run ends as a blow-up if its bounding box exceeds this multiple of that at rest
    compared : True to store in ``file`` also the subspace coordinates of each run, and its
        deviations from the full-order run
    """
    rows: list[dict[str, Any]] = []
    played = {
        name: runfiles.run_error(motions[kit.TRAIN].reference, m.reference)
        for name, m in motions.items()
    }
    made = clocked(_subspaces(motions[kit.TRAIN], settings))
    for of_columns, (base, columns, kind, k, models) in made:
        subspace.store_columns(file.create_group(f"columns/{base}"), columns)
        spent: dict[str, float] = defaultdict(float)
        for of_model, (method, samples) in clocked(models):
            # all ECSW samples are selected with the first model: its time is added to later models'
            family = subspace.ECSW if method.startswith(subspace.ECSW) else method
            spent[family] += of_model
            model = subspace.SubspaceModel(kind, columns, samples)
            labels: dict[str, Any] = {"method": method, "position_basis": kind, "k": k}
            store = file.create_group(f"models/{base}_{method}")
            subspace.store_model(store, {**labels, "base": base}, samples)
            labels |= {"group": "all", "reduction_s": of_columns + spent[family]}
            for name, motion in motions.items():
                scene = motion.scene
                outcome = subspace.rerun_model(scene, model, motion.reference, blowup_extent=limit)
                row = outcome.row(motion.displacement) | labels | {"motion": name}
                row["playback_error"] = played[name]
                row |= {"scene": scene.config.name, "r": model.elements_evaluated(scene)}
                if compared:
                    seen = motion.deviations(outcome)
                    row["energy_ratio"] = largest(seen["energy"])
                    kept = {"coordinates": outcome.coordinates, "extent": outcome.extent, **seen}
                    for series, values in kept.items():
                        store[f"{name}/{series}"] = values
                rows.append(row)
                log.info("%s %s, %s: error %s", base, method, name, row["relative_error"])
    order = list(motions)
    return pd.DataFrame(sorted(rows, key=lambda row: order.index(row["motion"])), columns=_MADE)


def _subspaces(
    motion: Yardstick, settings: SubspaceModels
) -> Iterator[tuple[str, Columns, str, int, Iterator[tuple[str, Sampled]]]]:
    """Yield name, columns, kind and size k of every subspace, and an iterator over its models.

    A model is a pair of method and samples. Only even frames are used for training, as for bases of
    projections.
    """
    scene, points = motion.scene, motion.scene.mesh.points
    count = max(plan.train for plan in scene.config.reduce.values())
    frames = training_frames(scene.config.frames, count)
    spaces: dict[str, SampledSpace | None] = {}
    if settings.hrpd is not None:
        spaces = {g.name: sampled_space(g, points, settings.hrpd) for g in scene.groups}

    def samplings(columns: Columns, methods: list[str]) -> Iterator[tuple[str, Sampled]]:
        """Yield pairs (method, samples) of all models in the subspace spanned by ``columns``."""
        if FULL in methods:
            yield FULL, {}
        if any(method.startswith(subspace.ECSW) for method in methods):
            asked, norm = settings.tolerances, settings.norm
            found = subspace.sample_elements(scene, columns, frames, asked, norm=norm)
            for tolerance, samples in zip(asked, found, strict=True):
                yield subspace.ecsw_name(tolerance), samples
        if HRPD in methods:
            yield HRPD, {g.name: hrpd(g, columns, spaces[g.name]) for g in scene.groups}

    for kind in settings.bases:
        for k in settings.sizes:
            columns = subspace.make_columns(scene, motion.reference[1:][frames], kind, k=k)
            models = samplings(columns, settings.methods(kind, k))
            yield f"{kind}_k{k:03d}", columns, kind, k, models


LARGEST = 3_000_000  # largest size of the file for the web page, bytes
GHOST = 250_000  # the file has at most about so many vertex positions of the full-order run
JOINT = "deim-joint"
FORMAT = 1
Labelled = tuple[dict[str, Any], subspace.SubspaceModel]


class LiveModels(ConfigModel):
    """Settings of the models on the web page; models that the study does not have are left out.

    ``sizes`` are numbers of modes k. ``joint_rows`` is the number of modes r of models whose
    projections are interpolated from rows that are chosen once for x, y and z together."""

    sizes: tuple[kit.Modes, ...] = (10, 20, 40)
    tolerances: tuple[kit.Tolerance, ...] = (3e-2, 1e-2, 1e-3)
    joint_rows: kit.Modes = 20


class Live(LiveModels):
    """Section ``live``: models on the web page, and ``scenes`` from which a reader can choose.

    Scenes for which the study has no models in position subspaces are left out.
    """

    scenes: tuple[SceneName, ...] = ()


class JointRows(kit.OfScene):
    """Constraint group that method `JOINT` reduces: it samples x, y and z of each selected row."""

    group: str
    method: str = JOINT
    spec: MethodSpec


class Options(ConfigModel):
    """Settings of the experiment `live` for one scene."""

    scene: SceneConfig
    title: str
    live: LiveModels
    joint_rows: tuple[JointRows, ...]


@experiment(
    "Models of {scene} for the page",
    reads={
        "mesh": paths.MESH,
        "train": paths.TRAIN,
        "subspaces": EachOf(paths.SUBSPACES, "with_subspaces"),
        "online": EachOf(paths.ONLINE_MODELS, "with_online_models"),
        "bases": EachOf(paths.BASIS, "joint_rows"),
        "samplings": EachOf(paths.SAMPLING, "joint_rows"),
        "settings": Settings(Options),
    },
    writes={"out": paths.LIVE_MODEL},
)
def live(mesh: File, train: File, settings: Options, out: File, **files: list[File]) -> None:
    """Write reduced models of a scene and its full-order run to the file that the web page loads.

    ``bases`` and ``samplings`` are files of the groups that ``settings.joint_rows`` lists: each
    sampled row is used for x, y and z. StorageError if the file would be larger than `LARGEST`.
    """
    scene = kit.scene_of(settings.scene, mesh)
    reference = kit.positions_of(train)
    asked = settings.live
    chosen: list[Labelled] = []
    tolerances = {subspace.ecsw_name(tolerance): tolerance for tolerance in asked.tolerances}
    for file in (*files["subspaces"], *files["online"]):
        for own, model in subspace.load_models(file.path):
            method, kind, k = own["method"], own["position_basis"], own["k"]
            # the page gets only models with POD bases and sampled elements
            if method in tolerances and kind == "pod" and k in asked.sizes:
                labels = {"family": "elements", "k": k, "tau": tolerances[method]}
                chosen.append((labels, model))
    given = (settings.joint_rows, files["bases"], files["samplings"])
    for case, file, sampling in zip(*given, strict=True):
        basis = load_basis(file.path)
        # use the requested size, or the rank if it is smaller
        size = min(asked.joint_rows, basis.rank)
        reduction = runfiles.load_reduction(basis, sampling.path, case.spec, size)
        chosen += list(_joint(scene, case.group, reduction, chosen))
    used, triangles = np.unique(scene.mesh.triangles, return_inverse=True)
    stride = max(1, ceil((len(reference) - 1) * len(used) / GHOST))
    content = {
        "format": FORMAT,
        "scene": settings.scene.name,
        "title": settings.title,
        **exported.export_scene(scene),
        **_models(scene, chosen),
        # the surface, and positions of its vertices in every ``stride``-th full-order frame
        "shown": {
            "vertices": pack_array(used, "u4"),
            "triangles": pack_array(triangles.reshape(-1, 3), "u4"),
            "stride": stride,
            "full": pack_positions(reference[::stride, used]),
        },
        "motion": mean_motion(reference),
    }
    text = f"pdromLive({json.dumps(content, separators=(',', ':'), allow_nan=False)});\n"
    if len(text) > LARGEST:
        raise StorageError(
            f"{out.path}: {len(text) / 1e6:.1f} MB, allowed are {LARGEST / 1e6:.1f}: choose fewer "
            "sizes or tolerances (keys live.sizes, live.tolerances)"
        )
    write_text(text, out.path)
    log.info("%s: %d models, %.1f MB", settings.scene.name, len(chosen), len(text) / 1e6)


def _joint(
    scene: Scene, group: str, reduction: Reduction, beside: list[Labelled]
) -> Iterator[Labelled]:
    """Yield a model for each subspace in ``beside``, with ``group`` interpolated by ``reduction``.

    Other groups have the sampled elements of a model ``beside`` with this subspace. ``reduction``
    selects rows for x, y and z together.
    """
    for model in {id(model.columns): model for _, model in beside}.values():
        joint = interpolation_of(scene.group(group), model.columns, reduction)
        labels = {"family": "joint", "k": model.columns.modes, "r": reduction.r}
        samples = {**model.samples, group: joint}
        yield labels, subspace.SubspaceModel(model.position_basis, model.columns, samples)


def _models(scene: Scene, chosen: list[Labelled]) -> dict[str, Any]:
    """Contents of the file for the web page: all bases, and models, each with its basis's index."""
    by_basis: dict[int, list[subspace.SubspaceModel]] = {}
    for _, model in chosen:
        by_basis.setdefault(id(model.columns), []).append(model)
    places = {key: place for place, key in enumerate(by_basis)}
    return {
        "bases": [
            exported.export_basis(scene, own[0].columns, exported.needed_vertices(scene, own))
            for own in by_basis.values()
        ],
        "models": [
            {**labels, "basis": places[id(model.columns)], **exported.export_model(scene, model)}
            for labels, model in chosen
        ],
    }
