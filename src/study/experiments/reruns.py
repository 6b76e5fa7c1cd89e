"""Sampling of a group by one method, then the scene again with the group reduced, for every r."""

import logging
from collections.abc import Iterator
from typing import Any

import h5py
import numpy as np
import pandas as pd

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.energy import largest
from pdrom.model.metrics import relative_errors
from pdrom.model.scene import SceneConfig
from pdrom.reduction.basis import Basis, load_basis
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import reductions
from pdrom.reduction.sampling.local_step import rerun_reduced
from pdrom.reduction.snapshots import SPLITS, SnapshotSet, load_snapshots
from study.artifact import paths
from study.artifact.reads import Every, Settings
from study.experiments.kit import base as kit
from study.experiments.kit.base import experiment

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
MOTION = "motion"  # column of the held-out rows only


class Sweep(ConfigModel):
    """Basis sizes of the reconstruction error: all up to ``dense_to``, then every ``step``-th."""

    dense_to: kit.Count = 10
    step: kit.Count = 10

    def ranks(self, largest: int) -> list[int]:
        """Sizes 1 .. ``largest``, which is always among them."""
        dense = range(1, min(self.dense_to, largest) + 1)
        coarse = range(self.dense_to + self.step, largest + 1, self.step)
        return sorted({*dense, *coarse, largest} - {0})


class Options(ConfigModel):
    """Settings of samplings and reruns by one method."""

    scene: SceneConfig
    method: MethodSpec
    sweep: Sweep
    ranks: tuple[kit.Rank, ...]
    blowup_extent: kit.BlowupExtent
    solver: kit.Solver


@experiment(
    "Sampling and reruns of {scene}, {group} by {method}",
    reads={
        "mesh": paths.MESH,
        "fom": paths.TRAIN,
        "motions": Every(paths.FULL_ORDER),
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
def reruns(motions: list[paths.File], settings: Options, **files: paths.File) -> None:
    """Sample the group, then rerun the scene for every r, as trained and as held out.

    One job does all: starting another process takes longer than the sampling.
    """
    space, data = load_basis(files["basis"].path), load_snapshots(files["snapshots"].path)
    _sample(space, data, settings, files["sampling"], files["errors"])
    found = {}
    with write_hdf5(files["runs"].path) as file:
        for run in motions:
            motion = run["run"]
            scene = kit.scene_of(settings.scene, files["mesh"], motion)
            yardstick = Yardstick(scene, kit.positions_of(run))
            file.attrs.update(yardstick.units)
            store = file if motion == kit.TRAIN else file.create_group(motion)
            for name, values in yardstick.series.items():
                store[name] = values
            made = _runs(yardstick, files["sampling"], space, settings, store)
            found[motion] = pd.DataFrame(made, columns=COLUMNS)
    write_table(found.pop(kit.TRAIN), files["out"].path)
    heldout = [table.assign(**{MOTION: motion}) for motion, table in found.items()]
    write_table(pd.concat(heldout, ignore_index=True), files["heldout_table"].path)


def _runs(
    yardstick: Yardstick, sampling: paths.File, basis: Basis, settings: Options, file: h5py.Group
) -> Iterator[dict[str, Any]]:
    """Run a motion for every r and yield the rows; an r beyond the rank is a marked row.

    The runs go to ``file``, with positions where that is not a group of another one: of the
    training motion figures are drawn.
    """
    labels, scene = sampling.labels, yardstick.scene
    system = scene.system_with(settings.solver)
    for r in kit.resolve_ranks(settings.ranks, basis.rank):
        store = file.create_group(f"r{r:04d}")
        store.attrs.update(r=r, full=r == basis.rank, marked=r > basis.rank)
        if r > basis.rank:
            log.warning("r = %d exceeds the numerical rank %d: not run", r, basis.rank)
            yield {**labels, "r": r, "frames": 0}
            continue
        reduction = kit.load_reduction(basis, sampling.path, settings.method, r=r)
        outcome = rerun_reduced(
            scene, labels["group"], reduction, yardstick.reference, settings.blowup_extent, system
        )
        apart = yardstick.deviations(outcome)
        error = outcome.difference / np.sqrt(np.mean(yardstick.displacement**2))
        for name, values in {**apart, "error": error, "extent": outcome.extent}.items():
            store[name] = values
        kit.store_end(store, outcome, with_positions=file.name == "/")
        store.attrs["finite"] = outcome.finite
        measured = {"energy_ratio": largest(apart["energy"]), "gain": reduction.gain}
        yield {**labels, "r": r, **outcome.row(yardstick.displacement), **measured}
        log.info("r = %d: %d frames, blow-up %s", r, outcome.frames, outcome.blowup_frame)


def _sample(
    basis: Basis, data: SnapshotSet, settings: Options, sampling: paths.File, errors: paths.File
) -> None:
    """Select samples for every r of the sweep and of the reruns; write them and the error table.

    Parameters
    ----------
    basis, data : of the group, from its training snapshots, and all of its snapshots
    sampling, errors : files to write; their labels are the first columns of the table
    """
    labels = sampling.labels
    asked = kit.resolve_ranks(settings.ranks, basis.rank)
    wanted = {*settings.sweep.ranks(basis.rank), *asked} if basis.rank else set()
    rows = []
    with write_hdf5(sampling.path) as file:
        for r, reduction in reductions(basis, settings.method, sorted(wanted)).items():
            store, sampled = file.create_group(f"r{r:04d}"), reduction.sampling
            store["entries"], store["elements"] = sampled.entries, sampled.elements
            store.attrs["gain"], store.attrs["condition"] = reduction.gain, reduction.condition
            sizes = (reduction.gain, reduction.rows_sampled, len(reduction.elements))
            for split in SPLITS:
                p = getattr(data, split)
                # the rounding errors of n snapshots grow like sqrt(n)
                roundoff = data.roundoff * np.sqrt(len(p) / len(data.train))
                found = relative_errors(p, reduction.reconstruct(p), roundoff)
                own = (*labels.values(), r, split, *found, *sizes)
                rows.append(dict(zip(ERROR_COLUMNS, own, strict=True)))
    beyond = [r for r in asked if r > basis.rank]
    rows += [{**labels, "r": r, "split": split} for r in beyond for split in SPLITS]
    if beyond:
        log.warning("r = %s exceeds the numerical rank %d: marked rows", beyond, basis.rank)
    write_table(pd.DataFrame(rows, columns=ERROR_COLUMNS), errors.path)
