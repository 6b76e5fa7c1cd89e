"""Samples of a constraint group by one method, and runs reduced by them, at all basis sizes r.

`stability` runs one scene with several time steps and stiffnesses, with every method.
"""

import logging
from collections.abc import Iterator
from typing import Annotated, Any

import h5py
import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.energy import largest
from pdrom.model.metrics import relative_errors
from pdrom.model.runs import BLOWUP_EXTENT
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import Basis, load_basis
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun, rerun
from pdrom.reduction.sampling import reductions
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.snapshots import SPLITS, SnapshotSet, load_snapshots
from pdrom.reduction.subspace.model import SubspaceModel, load_models
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting, Settings
from study.experiments.kit import base as kit
from study.experiments.kit import runfiles
from study.experiments.kit.base import experiment
from study.experiments.references import converged_positions

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "r", "frames", "finite", "blowup_frame", "max_extent",
    "relative_error", "energy_ratio", "gain",
]  # fmt: skip
ERROR_COLUMNS = [
    "scene", "group", "method", "r", "split",
    "relative_error", "relative_error_x", "relative_error_y", "relative_error_z",
    "gain", "rows_sampled", "elements_sampled",
]  # fmt: skip
DENSE, STEP = 10, 10


def sweep(largest: int) -> set[int]:
    """Basis sizes of reconstruction errors: all to `DENSE`, then every `STEP`-th; ``largest``."""
    coarse = range(DENSE + STEP, largest + 1, STEP)
    return {*range(1, min(DENSE, largest) + 1), *coarse, largest} - {0}


class Options(ConfigModel):
    """Settings of the experiment `reruns` for one scene and method."""

    scene: SceneConfig
    method: MethodSpec
    ranks: tuple[kit.Rank, ...]


@experiment(
    "Sampling and reruns of {scene}, {group} by {method}",
    reads={
        "mesh": paths.MESH,
        "fom": paths.TRAIN,
        "motions": Every(paths.FULL_ORDER),
        "converged": Every(paths.CONVERGED),
        "snapshots": paths.SNAPSHOTS,
        "basis": paths.BASIS,
        "settings": Settings(Options),
    },
    writes={
        "sampling": paths.SAMPLING,
        "errors": paths.RECONSTRUCTION,
        "runs": paths.RERUNS,
        "out": paths.RERUNS_TRAIN,
        "heldout_table": paths.RERUNS_HELDOUT,
    },
)
def reruns(motions: list[File], converged: list[File], settings: Options, **files: File) -> None:
    """Sample a constraint group; run training and held-out motions with it reduced to every size r.

    One job does the sampling and the runs, as sampling takes less time than starting a process.
    """
    space, data = load_basis(files["basis"].path), load_snapshots(files["snapshots"].path)
    _sample(space, data, settings, files["sampling"], files["errors"])
    found = {}
    with write_hdf5(files["runs"].path) as file:
        for run, limit in zip(motions, converged, strict=True):
            motion = run["run"]
            scene = kit.scene_of(settings.scene, files["mesh"], motion)
            yardstick = Yardstick(scene, kit.positions_of(run), converged_positions(limit))
            file.attrs.update(yardstick.units)
            store = file if motion == kit.TRAIN else file.create_group(motion)
            for name, values in yardstick.series.items():
                store[name] = values
            made = _runs(yardstick, files["sampling"], space, settings, store)
            found[motion] = pd.DataFrame(made, columns=COLUMNS)
    write_table(found.pop(kit.TRAIN), files["out"].path)
    heldout = [table.assign(motion=motion) for motion, table in found.items()]
    write_table(pd.concat(heldout, ignore_index=True), files["heldout_table"].path)


def _runs(
    yardstick: Yardstick, sampling: File, basis: Basis, settings: Options, file: h5py.Group
) -> Iterator[dict[str, Any]]:
    """Run a motion at every basis size r, store the runs in ``file``, and yield their table rows.

    A size above the rank is not run: its row has no results, its group is ``marked``. Positions
    are stored for the training motion only, whose ``file`` is the root group.
    """
    labels = sampling.labels
    for r in kit.resolve_ranks(settings.ranks, basis.rank):
        store = file.create_group(f"r{r:04d}")
        store.attrs.update(r=r, full=r == basis.rank, marked=r > basis.rank)
        if r > basis.rank:
            log.warning("r = %d exceeds the numerical rank %d: not run", r, basis.rank)
            yield {**labels, "r": r, "frames": 0}
            continue
        reduction = runfiles.load_reduction(basis, sampling.path, settings.method, r=r)
        outcome = yardstick.run(ProjectionModel(labels["group"], reduction))
        apart = yardstick.deviations(outcome)
        error = outcome.difference / np.sqrt(np.mean(yardstick.displacement**2))
        for name, values in {**apart, "error": error, "extent": outcome.extent}.items():
            store[name] = values
        runfiles.store_end(store, outcome, with_positions=file.name == "/")
        store.attrs["finite"] = outcome.finite
        measured = {"energy_ratio": largest(apart["energy"]), "gain": reduction.gain}
        yield {**labels, "r": r, **yardstick.row(outcome), **measured}
        log.info("r = %d: %d frames, blow-up %s", r, outcome.frames, outcome.blowup_frame)


def _sample(
    basis: Basis, data: SnapshotSet, settings: Options, sampling: File, errors: File
) -> None:
    """Select samples of ``basis`` at all sizes r; write them, and errors of reconstructed ``data``.

    The first columns of the table are the labels (scene, group, method) of the file ``sampling``.
    """
    labels = sampling.labels
    asked = kit.resolve_ranks(settings.ranks, basis.rank)
    wanted = {*sweep(basis.rank), *asked} if basis.rank else set()
    rows = []
    with write_hdf5(sampling.path) as file:
        for r, reduction in reductions(basis, settings.method, sorted(wanted)).items():
            store, sampled = file.create_group(f"r{r:04d}"), reduction.sampling
            store["entries"], store["elements"] = sampled.entries, sampled.elements
            store.attrs["gain"], store.attrs["condition"] = reduction.gain, reduction.condition
            sizes = (reduction.gain, reduction.rows_sampled, len(reduction.elements))
            for split in SPLITS:
                p = getattr(data, split)
                # the norm of the rounding errors of n snapshots grows like sqrt(n)
                roundoff = data.roundoff * np.sqrt(len(p) / len(data.train))
                found = relative_errors(p, reduction.reconstruct(p), roundoff)
                own = (*labels.values(), r, split, *found, *sizes)
                rows.append(dict(zip(ERROR_COLUMNS, own, strict=True)))
    beyond = [r for r in asked if r > basis.rank]
    rows += [{**labels, "r": r, "split": split} for r in beyond for split in SPLITS]
    if beyond:
        log.warning("r = %s exceeds the numerical rank %d: marked rows", beyond, basis.rank)
    write_table(pd.DataFrame(rows, columns=ERROR_COLUMNS), errors.path)


SHORT_COLUMNS = [
    "scene", "method", "r", "h", "stiffness_ratio", "finite", "blowup_frame", "max_extent",
    "energy_ratio", "gain", "group", "position_basis", "k", "frames", "relative_error",
]  # fmt: skip
FEWEST, MOST = 30, 120  # limits of the number of frames of a short run
Models = list[tuple[dict[str, Any], SubspaceModel | ProjectionModel | None]]


class ShortRuns(ConfigModel):
    """Settings of short runs with other time steps and other stiffnesses of the reduced groups.

    Bases and samples remain those of the scene's own time step and stiffness, so that the runs show
    how far from these values a reduction can be used.

    ranks : basis sizes r of reductions; position subspaces are run at their largest size only
    time_steps : time steps in seconds, in addition to the scene's own one
    stiffness_ratios : factors by which weights of reduced groups are multiplied, in addition to 1
    duration : simulated seconds; a run has `FEWEST` to `MOST` frames
    """

    ranks: tuple[kit.Rank, ...] = ()
    time_steps: tuple[Annotated[float, Field(gt=0.0, le=10.0)], ...] = ()
    stiffness_ratios: tuple[Annotated[float, Field(gt=0.0, le=1e8)], ...] = ()
    duration: Annotated[float, Field(gt=0.0)] = 1.0


class Stability(ShortRuns):
    """Section ``stability``: short runs, and limits by which a run is judged.

    scenes : names of the scenes; those that are not in the study are ignored
    wrong : a finite run counts as wrong if its relative error exceeds this value
    left : a run counts as having left the scene if its bounding box exceeds this multiple of the
        full-order run's largest one
    """

    scenes: tuple[str, ...] = ()
    wrong: Annotated[float, Field(gt=0.0)] = 0.1
    left: Annotated[float, Field(gt=1.0)] = 2.0


@experiment(
    "Time step and stiffness of {scene}",
    reads={
        "mesh": paths.MESH,
        "bases": Every(paths.BASIS),
        "samplings": Every(paths.SAMPLING),
        "subspaces": Every(paths.SUBSPACES),
        "config": Setting("scene"),
        "methods": Setting("methods"),
        "short": Setting("stability"),
    },
    writes={"out": paths.STABILITY},
)
def stability(
    mesh: File,
    config: SceneConfig,
    methods: runfiles.Methods,
    short: ShortRuns,
    out: File,
    **files: list[File],
) -> None:
    """Make full-order and reduced runs with each time step, then with each stiffness of `short`."""
    scene = kit.scene_of(config, mesh)
    given = files["samplings"], files["bases"], methods, short.ranks
    models: Models = [
        (labels | {"position_basis": "full"}, model)
        for labels, model in runfiles.projection_models(*given)
    ]
    for file in files["subspaces"]:
        found = load_models(file.path)
        largest = max(labels["k"] for labels, _ in found)
        models += [({"group": "all", **own}, model) for own, model in found if own["k"] == largest]
    # time step and stiffness are varied one at a time, never both
    h, ratios = scene.config.time_step, sorted({1.0, *short.stiffness_ratios} - {1.0})
    grid = [(step, 1.0) for step in sorted({h, *short.time_steps})] + [(h, own) for own in ratios]
    rows = []
    for step, ratio in grid:
        other = kit.varied(scene.config, step, ratio, short.duration, (FEWEST, MOST))
        own = {"scene": config.name, "h": step, "stiffness_ratio": ratio}
        rows += [own | row for row in _rows(Scene.build(other, scene.mesh), models)]
        log.info("h = %g s, stiffness times %g: %d frames", step, ratio, other.frames)
    table = pd.DataFrame(rows, columns=SHORT_COLUMNS)
    whole = ["r", "blowup_frame", "k", "frames"]
    write_table(table.astype(dict.fromkeys(whole, "Int64")), out.path)


def _rows(scene: Scene, models: Models) -> Iterator[dict[str, Any]]:
    """Yield rows of the full-order run of ``scene`` and, if it is finite, of all reduced runs.

    A model of a basis with too few modes is None; its row has no results.
    """
    loop, start = scene.stepper(track_objective=False), scene.initial_state()
    full = rerun(scene, loop, start, None, BLOWUP_EXTENT)
    own = Yardstick(scene, full.positions)

    def row(labels: dict[str, Any], outcome: Rerun) -> dict[str, Any]:
        energy = largest(own.scale.relative(outcome.positions))
        return {**labels, **own.row(outcome), "energy_ratio": energy}

    whole = row({"method": "full", "position_basis": "full"}, full)
    if not full.finite:
        log.warning("the full-order run blew up: nothing to compare with")
        yield whole
        return
    yield {**whole, "relative_error": 0.0}
    for labels, model in models:
        if model is None:
            yield {**labels, "frames": 0}
            continue
        gain = {"gain": model.reduction.gain} if isinstance(model, ProjectionModel) else {}
        yield row({**labels, **gain}, own.run(model))
