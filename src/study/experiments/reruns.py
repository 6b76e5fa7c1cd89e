"""Sample the projections of a constraint group and run the reduced scenes, at all basis sizes r."""

import logging
from collections.abc import Iterator

import h5py
import numpy as np
import pandas as pd

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.metrics import relative_errors
from pdrom.model.scene import SceneConfig
from pdrom.reduction.basis import Basis, load_basis
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.snapshots import SPLITS, SnapshotSet, load_snapshots
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Settings
from study.experiments.kit import base as kit
from study.experiments.kit.runs import Row, run, store_end, store_series
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
TEST_FRAMES = 20  # of a test trajectory, the positions of frames 0, 20, 40, ... are stored


def sweep(largest: int) -> set[int]:
    """Return sizes for reconstruction errors: all to `DENSE`, then every `STEP`-th; ``largest``."""
    coarse = range(DENSE + STEP, largest + 1, STEP)
    return {*range(1, min(DENSE, largest) + 1), *coarse, largest} - {0}


class Options(ConfigModel):
    """Settings of the experiment `reruns` for one scene and method."""

    scene: SceneConfig
    method: MethodSpec
    ranks: tuple[kit.Rank, ...]


@kit.experiment(
    "Sampling and reduced runs of {scene}: {group} by {method}",
    reads={
        "mesh": paths.MESH,
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
    """Sample a constraint group; run training and test trajectories with each reduced size r.

    One job does the sampling and the runs, as sampling takes less time than starting a process.
    """
    basis, data = load_basis(files["basis"].path), load_snapshots(files["snapshots"].path)
    sampled = _sample(basis, data, settings, files["sampling"], files["errors"])
    labels: Row = dict(files["sampling"].labels)
    found = {}
    with write_hdf5(files["runs"].path) as file:
        for full, limit in zip(motions, converged, strict=True):
            motion = full["run"]
            scene = kit.scene_of(settings.scene, files["mesh"], motion)
            yardstick = Yardstick(scene, kit.positions_of(full), converged_positions(limit))
            file.attrs.update(yardstick.units)
            store = file if motion == kit.TRAIN else file.create_group(motion)
            for name, values in yardstick.series.items():
                store[name] = values
            made = _runs(yardstick, labels, sampled, basis.rank, store)
            found[motion] = pd.DataFrame(made, columns=COLUMNS)
    write_table(found.pop(kit.TRAIN), files["out"].path)
    heldout = [table.assign(motion=motion) for motion, table in found.items()]
    write_table(pd.concat(heldout, ignore_index=True), files["heldout_table"].path)


def _runs(
    yardstick: Yardstick, labels: Row, sampled: dict[int, Reduction | None], rank: int,
    file: h5py.Group,
) -> Iterator[Row]:  # fmt: skip
    """Run a trajectory with every reduction, store the runs in ``file``, and yield table rows.

    A size r above the rank is not run: its row has no results, its HDF5 group is ``marked``. Only
    training runs, whose ``file`` is the root group, store the positions of all frames.
    """
    for r, reduction in sampled.items():
        store, row, outcome = file.create_group(f"r{r:04d}"), labels | {"r": r, "frames": 0}, None
        store.attrs["full"] = r == rank
        if reduction is not None:
            model = ProjectionModel(labels["group"], reduction)
            row, outcome = run(yardstick, model, row | {"gain": reduction.gain})
            row["energy_ratio"] = store_series(store, yardstick, outcome)
            log.info("r = %d: %d frames, blow-up %s", r, outcome.frames, outcome.blowup_frame)
        store_end(store, outcome, r, every=1 if file.name == "/" else TEST_FRAMES)
        yield row


def _sample(
    basis: Basis, data: SnapshotSet, settings: Options, sampling: File, errors: File
) -> dict[int, Reduction | None]:
    """Select samples of ``basis`` at all sizes r; write them, and errors of reconstructed ``data``.

    Returns the reductions of the sizes in ``settings``, None for sizes above the rank. The first
    columns of the table are the labels (scene, group, method) of the file ``sampling``.
    """
    labels = sampling.labels
    asked = kit.resolve_ranks(settings.ranks, basis.rank)
    wanted = {*sweep(basis.rank), *asked} if basis.rank else set()
    found, rows = reductions(basis, settings.method, sorted(wanted)), []
    with write_hdf5(sampling.path) as file:
        for r, reduction in found.items():
            store, sampled = file.create_group(f"r{r:04d}"), reduction.sampling
            store["entries"], store["elements"] = sampled.entries, sampled.elements
            store.attrs["gain"], store.attrs["condition"] = reduction.gain, reduction.condition
            sizes = (reduction.gain, reduction.rows_sampled, len(reduction.elements))
            for split in SPLITS:
                p = getattr(data, split)
                # the norm of the rounding errors of n snapshots is proportional to sqrt(n)
                roundoff = data.roundoff * np.sqrt(len(p) / len(data.train))
                apart = relative_errors(p, reduction.reconstruct(p), roundoff)
                own = (*labels.values(), r, split, *apart, *sizes)
                rows.append(dict(zip(ERROR_COLUMNS, own, strict=True)))
    beyond = [r for r in asked if r > basis.rank]
    rows += [{**labels, "r": r, "split": split} for r in beyond for split in SPLITS]
    if beyond:
        log.warning("r = %s exceeds the numerical rank %d: not run", beyond, basis.rank)
    write_table(pd.DataFrame(rows, columns=ERROR_COLUMNS), errors.path)
    return {r: found.get(r) for r in asked}
