"""Make and run models in position subspaces, with all, sampled or interpolated projections.

The methods are full, ecsw (energy-conserving sampling) and hrpd (interpolation). For a large scene,
one job also makes the full-order runs. `live` writes models to a file that a web page loads.
"""

import logging
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path
from time import process_time
from typing import Any

import h5py
import pandas as pd

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.held_out import MOTIONS
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import load_basis
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction
from pdrom.reduction.snapshots import training_frames
from pdrom.reduction.subspace import exported
from pdrom.reduction.subspace import model as subspace
from pdrom.reduction.subspace.hrpd import HrpdSpec, hrpd, sampled_space
from pdrom.reduction.subspace.interpolation import interpolation_of
from pdrom.reduction.subspace.training import make_columns, sampled_models
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import EachOf, Every, Setting, Settings, SourcesOf
from study.experiments.kit import base as kit
from study.experiments.kit.models import load_reduction
from study.experiments.kit.runs import Row, run, store_series
from study.experiments.references import converged_positions, run_error

log = logging.getLogger(__name__)

_RUN = [
    "scene", "group", "method", "position_basis", "k", "r", "frames", "finite", "blowup_frame",
    "max_extent", "training_residual", "relative_error",
]  # fmt: skip
COLUMNS = [*_RUN, "energy_ratio"]
_MADE = [*COLUMNS, "deformation_error", "motion", "playback_error", "tau", "reduction_s"]
SECONDS_COLUMNS = ["scene", "position_basis", "k", "method", "reduction_s"]
LARGE_COLUMNS = [
    *_RUN, "deformation_error", "motion", "playback_error", "tau", "vertices", "elements",
    "iterations", "reduction_s",
]  # fmt: skip
FULL, HRPD = "full", "hrpd"


class Hrpd(HrpdSpec):
    """Settings of models with interpolated projections; ``sizes`` are their numbers of modes k."""

    sizes: tuple[kit.Modes, ...] = ()


class SubspaceModels(ConfigModel):
    """Settings of models in position subspaces.

    bases, sizes : kinds of basis, and numbers of modes k
    tolerances : relative residuals of energy-conserving sampling (ecsw)
    hrpd : settings of models with interpolated projections; None: no models of this kind
    """

    bases: tuple[kit.PositionBasis, ...] = ("pod", "skinning")
    sizes: tuple[kit.Modes, ...] = (10, 40)
    tolerances: tuple[kit.Tolerance, ...] = (3e-2, 1e-2)
    hrpd: Hrpd | None = None

    def methods(self, kind: str, k: int) -> list[str]:
        """Return the names of the configured models on a basis of ``kind`` with k modes."""
        if kind not in self.bases or k not in self.sizes:
            return []
        tolerances = self.tolerances if kind == "pod" else ()
        interpolated = self.hrpd is not None and k in self.hrpd.sizes
        full = [] if isinstance(self, LargeModels) else [FULL]
        return [*full, *map(subspace.ecsw_name, tolerances), *([HRPD] if interpolated else [])]


class Subspace(SubspaceModels):
    """Section ``subspace``: models in position subspaces, and their ``scenes`` (default: all)."""

    scenes: tuple[SceneName, ...] = ()


class LargeModels(SubspaceModels):
    """Settings of models of a large scene; none evaluates all elements, which takes too long."""

    bases: tuple[kit.PositionBasis, ...] = ("pod",)
    sizes: tuple[kit.Modes, ...] = (20,)
    tolerances: tuple[kit.Tolerance, ...] = (1e-2,)


class Online(LargeModels):
    """Section ``online``: large ``scenes``, and settings of the reduced models made of them."""

    scenes: tuple[str, ...] = ()


@kit.experiment(
    "Position subspaces of {scene}, with full and with sampled projections",
    reads={
        "mesh": paths.MESH,
        "full_order": Every(paths.FULL_ORDER),
        "converged": Every(paths.CONVERGED),
        "config": Setting("scene"),
        "asked": Setting("subspace"),
    },
    writes={
        "out": paths.SUBSPACES,
        "train_table": paths.SUBSPACES_TRAIN,
        "heldout_table": paths.SUBSPACES_HELDOUT,
        "seconds_table": paths.SUBSPACES_SECONDS,
    },
)
def subspaces(
    full_order: list[File], converged: list[File], config: SceneConfig, asked: SubspaceModels,
    **files: File,
) -> None:  # fmt: skip
    """Build a model for every basis, size and sampling, and run all trajectories with each."""
    motions = {
        run["run"]: Yardstick(
            kit.scene_of(config, files["mesh"], run["run"]),
            kit.positions_of(run),
            converged_positions(limit),
        )
        for run, limit in zip(full_order, converged, strict=True)
    }
    with write_hdf5(files["out"].path) as file:
        for name, motion in motions.items():
            for series, values in motion.series.items():
                file[f"{series}/{name}"] = values
        file.attrs.update(motions[kit.TRAIN].units)
        rows = _runs(file, motions, asked, compared=True)
    train, heldout = rows[rows.motion == kit.TRAIN], rows[rows.motion != kit.TRAIN]
    write_table(train[COLUMNS], files["train_table"].path)
    write_table(heldout[[*COLUMNS, "motion"]], files["heldout_table"].path)
    write_table(train[SECONDS_COLUMNS], files["seconds_table"].path)


@kit.experiment(
    "Reduced models of {scene}",
    reads={
        "sources": SourcesOf("scene.mesh"),
        "config": Setting("scene"),
        "asked": Setting("online"),
    },
    writes={"out": paths.ONLINE, "models": paths.ONLINE_MODELS},
)
def online(
    sources: list[Path], config: SceneConfig, asked: LargeModels, out: File, models: File
) -> None:
    """Build every model of a large scene, and run all trajectories with each model.

    The mesh is built from the files ``sources``; the full-order runs are not stored.
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
        rows = _runs(file, motions, asked, compared=False)
    table = rows.assign(
        vertices=mesh.vertices,
        elements=sum(group.elements for group in scenes[kit.TRAIN].groups),
        iterations=config.iterations,
    )
    write_table(table[LARGE_COLUMNS], out.path)


def _runs(
    file: h5py.File, motions: Mapping[str, Yardstick], settings: SubspaceModels, compared: bool
) -> pd.DataFrame:
    """Train every model on the training trajectory, run all trajectories, and return table rows.

    The models are written to ``file``, and if ``compared``, also the subspace coordinates of each
    run and its deviations from the full-order run.
    """
    rows: list[Row] = []
    training = motions[kit.TRAIN]
    played = {name: run_error(training.reference, m.reference) for name, m in motions.items()}
    for labels, model in _models(training, settings):
        base = f"{labels['position_basis']}_k{labels['k']:03d}"
        if f"columns/{base}" not in file:
            subspace.store_columns(file.create_group(f"columns/{base}"), model.columns)
        store = file.create_group(f"models/{base}_{labels['method']}")
        kept = {name: labels[name] for name in ("method", "position_basis", "k")}
        subspace.store_model(store, {**kept, "base": base}, model.samples)
        own = {"group": "all", "training_residual": model.residual, **labels}
        for name, motion in motions.items():
            scene = motion.scene
            own |= {"scene": scene.config.name, "r": model.elements_evaluated(scene)}
            row, outcome = run(motion, model, own | {"motion": name})
            row["playback_error"] = played[name]
            if compared:
                own_store, z = store.create_group(name), outcome.coordinates
                row["energy_ratio"] = store_series(own_store, motion, outcome, coordinates=z)
            else:
                _, row["deformation_error"] = motion.errors(outcome.positions, scene.config.frames)
            rows.append(row)
            log.info("%s %s, %s: error %s", base, labels["method"], name, row["relative_error"])
    rows.sort(key=lambda row: list(motions).index(row["motion"]))
    return pd.DataFrame(rows, columns=_MADE)


def _models(motion: Yardstick, settings: SubspaceModels) -> Iterator[subspace.Labelled]:
    """Yield labels (with the time of the training) and model for each of ``settings``.

    Only even frames of the trajectory are used for training, as for bases of projections.
    """
    scene, points = motion.scene, motion.scene.mesh.points
    count = max(plan.train for plan in scene.config.reduce.values())
    frames = training_frames(scene.config.frames, count)
    for kind, k in product(settings.bases, settings.sizes):
        methods, modes = settings.methods(kind, k), dict[str, Any]({kind: k})
        started = process_time()
        columns = make_columns([scene], motion.reference[1:][frames], **modes)
        spent = process_time() - started
        labels: dict[str, Any] = {"position_basis": kind, "k": k, "reduction_s": spent}
        if FULL in methods:
            yield labels | {"method": FULL}, subspace.SubspaceModel(columns)
        tolerances = [t for t in settings.tolerances if subspace.ecsw_name(t) in methods]
        if tolerances:
            started = process_time()
            models = sampled_models([scene], columns, frames, tolerances)
            seconds = spent + process_time() - started
            for tau, model in zip(tolerances, models, strict=True):
                name = subspace.ecsw_name(tau)
                yield labels | {"method": name, "tau": tau, "reduction_s": seconds}, model
        if settings.hrpd is not None and HRPD in methods:
            started, spec = process_time(), settings.hrpd
            found = {g.name: hrpd(g, columns, sampled_space(g, points, spec)) for g in scene.groups}
            seconds = spent + process_time() - started
            model = subspace.SubspaceModel(columns, found)
            yield labels | {"method": HRPD, "reduction_s": seconds}, model


JOINT = "deim-joint"


class LiveModels(ConfigModel):
    """Settings of the models on the web page; models that the study does not have are left out.

    ``sizes`` are numbers of modes k. ``joint_rows`` is the number of modes r of models that
    interpolate projections from selected rows, each shared by x, y and z."""

    sizes: tuple[kit.Modes, ...] = (10, 20, 40)
    tolerances: tuple[kit.Tolerance, ...] = (3e-2, 1e-2, 1e-3)
    joint_rows: kit.Modes = 20


class Live(LiveModels):
    """Section ``live``: models on the web page, and ``scenes`` between which a reader can choose.

    Scenes for which the study has no models in position subspaces are left out.
    """

    scenes: tuple[SceneName, ...] = ()


class JointRows(kit.OfScene):
    """A constraint group that method `JOINT` reduces, with one shared row for x, y and z."""

    group: str
    method: str = JOINT
    spec: MethodSpec


class Options(ConfigModel):
    """Settings of the experiment `live` for one scene."""

    scene: SceneConfig
    title: str
    live: LiveModels
    joint_rows: tuple[JointRows, ...]


@kit.experiment(
    "Models of {scene} for the web page",
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

    ``bases`` and ``samplings`` are files of the groups that ``settings.joint_rows`` lists, where x,
    y and z share each sampled row.
    """
    scene = kit.scene_of(settings.scene, mesh)
    reference = kit.positions_of(train)
    asked = settings.live
    chosen: list[subspace.Labelled] = []
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
        reduction = load_reduction(basis, sampling.path, case.spec, size)
        chosen += list(_joint(scene, case.group, reduction, chosen))
    exported.write_page_models(scene, settings.title, reference, chosen, out.path)
    log.info("%s: %d models", settings.scene.name, len(chosen))


def _joint(
    scene: Scene, group: str, reduction: Reduction, beside: list[subspace.Labelled]
) -> Iterator[subspace.Labelled]:
    """Yield a model for each subspace in ``beside``, with ``group`` interpolated by ``reduction``.

    All other groups keep the sampled elements of a model in ``beside``. The rows that ``reduction``
    selects are shared by x, y and z.
    """
    for model in {id(model.columns): model for _, model in beside}.values():
        joint = interpolation_of(scene.group(group), model.columns, reduction)
        labels = {"family": "joint", "k": model.columns.modes, "r": reduction.r}
        yield labels, replace(model, samples={**model.samples, group: joint})
