"""Sampling of a group by one method, then the scene again with the group reduced, for every r."""

import logging
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
import pandas as pd

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.energy import largest
from pdrom.model.held_out import FIRST
from pdrom.model.metrics import relative_errors
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import Basis, load_basis
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.sampling.local_step import rerun_reduced
from pdrom.reduction.snapshots import SPLITS, SnapshotSet, load_snapshots
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Settings
from study.experiments.kit.declaration import experiment
from study.experiments.kit.load_reduction import load_reduction
from study.experiments.kit.scenes import TRAIN as TRAINING
from study.experiments.kit.scenes import positions_of, scene_of
from study.experiments.kit.settings import BlowupExtent, Count, Rank, Solver, resolve_ranks

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

    dense_to: Count = 10
    step: Count = 10

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
    ranks: tuple[Rank, ...]
    heldout_ranks: tuple[Rank, ...]
    blowup_extent: BlowupExtent
    solver: Solver


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
def reruns(
    mesh: File,
    fom: File,
    motions: list[File],
    snapshots: File,
    basis: File,
    settings: Options,
    sampling: File,
    errors: File,
    runs: File,
    out: File,
    heldout_table: File,
) -> None:
    """Sample the group, then rerun the scene for every r, as trained and as held out.

    One job does all: starting another process takes longer than the sampling. The first held-out
    motion runs with the ``heldout_ranks``, the others with the full one if it is among them.
    """
    space, data = load_basis(basis.path), load_snapshots(snapshots.path)
    sample(
        space,
        data,
        settings.method,
        sweep=settings.sweep,
        ranks=settings.ranks,
        sampling=sampling,
        errors=errors,
    )
    labels = runs.labels
    full = tuple(rank for rank in settings.heldout_ranks if rank == "full")
    ranks = {TRAINING: settings.ranks, FIRST: settings.heldout_ranks}
    found = {}
    with write_hdf5(runs.path) as file:
        for run in motions:
            motion, reference = run["run"], positions_of(run)
            scene = scene_of(settings.scene, mesh, motion)
            case = _Case(scene, motion, labels, settings, space, sampling.path)
            yardstick = Yardstick(scene, reference)
            file.attrs.update(yardstick.units)
            store = file if motion == TRAINING else file.create_group(motion)
            rows = case.run(store, ranks.get(motion, full), yardstick)
            found[motion] = pd.DataFrame(rows, columns=COLUMNS)
    write_table(found.pop(TRAINING), out.path)
    heldout = [table.assign(**{MOTION: motion}) for motion, table in found.items()]
    write_table(pd.concat(heldout, ignore_index=True), heldout_table.path)


@dataclass(frozen=True)
class _Case:
    """One motion of a scene with one method."""

    scene: Scene
    motion: str
    labels: dict[str, str]
    settings: Options
    basis: Basis
    sampling: str

    def run(
        self, file: h5py.Group, ranks: tuple[Rank, ...], yardstick: Yardstick
    ) -> list[dict[str, Any]]:
        """Rerun for every r and return the rows; an r beyond the rank is a marked row.

        Parameters
        ----------
        yardstick : the motion's full-order run
        """
        settings, group, reference = self.settings, self.labels["group"], yardstick.reference
        for name, values in yardstick.series.items():
            file[name] = values
        system = self.scene.system_with(settings.solver)
        rows = []
        for r in resolve_ranks(ranks, self.basis.rank):
            store = file.create_group(f"r{r:04d}")
            store.attrs.update(r=r, full=r == self.basis.rank, marked=r > self.basis.rank)
            if r > self.basis.rank:
                log.warning("r = %d exceeds the numerical rank %d: not run", r, self.basis.rank)
                rows.append({**self.labels, "r": r, "frames": 0})
                continue
            reduction = load_reduction(self.basis, self.sampling, settings.method, r=r)
            outcome = rerun_reduced(
                self.scene, group, reduction, reference, settings.blowup_extent, system
            )
            apart = yardstick.deviations(outcome)
            for name, values in apart.items():
                store[name] = values
            _store(store, outcome, yardstick.displacement)
            if self.motion == TRAINING:  # of which figures are drawn
                store["positions"] = outcome.positions.astype(np.float32)
            measured = {"energy_ratio": largest(apart["energy"]), "gain": reduction.gain}
            row = outcome.row(yardstick.displacement)
            rows.append({**self.labels, "r": r, **row, **measured})
            log.info("r = %d: %d frames, blow-up %s", r, outcome.frames, outcome.blowup_frame)
        return rows


def _store(store: h5py.Group, outcome: Rerun, displacement: np.ndarray) -> None:
    store["error"] = outcome.difference / np.sqrt(np.mean(displacement**2))
    store["extent"] = outcome.extent
    blowup = -1 if outcome.blowup_frame is None else outcome.blowup_frame
    store.attrs.update(finite=outcome.finite, blowup_frame=blowup, max_extent=outcome.max_extent)


def sample(
    basis: Basis,
    data: SnapshotSet,
    method: MethodSpec,
    sweep: Sweep,
    ranks: tuple[Rank, ...],
    sampling: File,
    errors: File,
) -> None:
    """Select samples for every r of the sweep and of the reruns; write them and the error table.

    Parameters
    ----------
    basis, data : of the group, from its training snapshots, and all of its snapshots
    method : its rows and criterion of the selection
    ranks : sizes of the reruns
    sampling, errors : files to write; their labels are the first columns of the table
    """
    labels = sampling.labels
    asked = resolve_ranks(ranks, basis.rank)
    wanted = {*sweep.ranks(basis.rank), *asked} if basis.rank else set()
    rows = []
    with write_hdf5(sampling.path) as file:
        for r, reduction in reductions(basis, method, sorted(wanted)).items():
            store, sampled = file.create_group(f"r{r:04d}"), reduction.sampling
            store["entries"], store["elements"] = sampled.entries, sampled.elements
            store.attrs["gain"], store.attrs["condition"] = reduction.gain, reduction.condition
            rows += [{**labels, "r": r, **row} for row in _errors(reduction, data)]
    beyond = [r for r in asked if r > basis.rank]
    rows += [{**labels, "r": r, "split": split} for r in beyond for split in SPLITS]
    if beyond:
        log.warning("r = %s exceeds the numerical rank %d: marked rows", beyond, basis.rank)
    write_table(pd.DataFrame(rows, columns=ERROR_COLUMNS), errors.path)


def _errors(reduction: Reduction, data: SnapshotSet) -> list[dict[str, Any]]:
    rows = []
    for split in SPLITS:
        p = getattr(data, split)
        # the rounding errors of n snapshots grow like sqrt(n)
        roundoff = data.roundoff * np.sqrt(len(p) / len(data.train))
        total, x, y, z = relative_errors(p, reduction.reconstruct(p), roundoff)
        rows.append(
            {
                "split": split,
                "relative_error": total,
                "relative_error_x": x,
                "relative_error_y": y,
                "relative_error_z": z,
                "gain": reduction.gain,
                "rows_sampled": reduction.rows_sampled,
                "elements_sampled": len(reduction.elements),
            }
        )
    return rows
