"""Table reduced_reruns: errors of the reruns, over the run and within the horizon, with times."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.core.store import open_hdf5, read_table
from pdrom.model.runs.horizon import HELDOUT, error_within, floor_of, horizons
from pdrom.tables.columns import conform

KEYS = ["scene", "group", "method", "position_basis", "k", "r"]


def reduced_reruns(
    reruns: Iterable[str],
    hyper: Iterable[str],
    timings: Iterable[str],
    sensitivity: pd.DataFrame,
    perturbation: float,
    threshold: float,
) -> pd.DataFrame:
    """One row per scene, group, method and r, then the runs in position subspaces.

    ``reruns`` are the HDF5 files ``.../{scene}/{group}/{method}.h5``, ``hyper`` those of the
    subspaces ``.../{scene}/models.h5``, each with a table of the same name beside it. In a subspace
    all groups are reduced, and r counts the evaluated elements. The error within the horizon uses
    the frames before it only; a run that blew up before has none.
    """
    table = _collect(reruns, hyper, sensitivity, perturbation, threshold, "train")
    return conform(_with_times(table, timings), "reduced_reruns")


def heldout_reruns(
    reruns: Iterable[str],
    hyper: Iterable[str],
    sensitivity: pd.DataFrame,
    threshold: float,
) -> pd.DataFrame:
    """The same for the held-out motions, which no basis and no sampling has seen."""
    table = _collect(reruns, hyper, sensitivity, HELDOUT, threshold, "heldout")
    return conform(table, "heldout_reruns")


def _collect(
    reruns: Iterable[str],
    hyper: Iterable[str],
    sensitivity: pd.DataFrame,
    perturbation: float | str,
    threshold: float,
    motion: str,
) -> pd.DataFrame:
    """All runs of a motion with errors, horizons and floors."""
    ends = horizons(sensitivity, perturbation, threshold)
    parts = [_local_only(path, ends, motion) for path in reruns]
    parts += [_subspace(path, ends, motion) for path in hyper]
    table = pd.concat(parts, ignore_index=True)
    table["horizon_frame"] = table.scene.map(ends)
    floors = {s: floor_of(sensitivity, s, perturbation)[:end] for s, end in ends.items()}
    table["sensitivity_floor"] = table.scene.map(
        {scene: float(floor.max(initial=0.0)) for scene, floor in floors.items()}
    )
    for column in ("k", "r", "frames", "blowup_frame", "horizon_frame"):
        table[column] = table[column].astype("Int64")
    table["finite"] = table["finite"].astype("boolean")
    return table


def _table_beside(path: str, motion: str) -> pd.DataFrame:
    """The table that belongs to a file of runs."""
    suffix = "" if motion == "train" else f"_{motion}"
    return read_table(Path(path).with_name(f"{Path(path).stem}{suffix}.csv"))


def _local_only(path: str, ends: dict[str, int], motion: str) -> pd.DataFrame:
    """Rows of runs whose positions are not reduced."""
    table = _table_beside(path, motion)
    end = ends[Path(path).parent.parent.name]
    with open_hdf5(path) as file:
        runs = file if motion == "train" else file[motion]
        displacement = runs["displacement"][...]
        table["relative_error_within_horizon"] = [
            _error_within(runs[f"r{r:04d}"], displacement, end) for r in table.r
        ]
    return table.assign(position_basis="full", k=None)


def _subspace(path: str, ends: dict[str, int], motion: str) -> pd.DataFrame:
    """Rows of runs in position subspaces."""
    table = _table_beside(path, motion)
    end = ends[Path(path).parent.name]
    with open_hdf5(path) as file:
        displacement = file[f"displacement/{motion}"][...]
        models = [f"{t.position_basis}_k{t.k:03d}_{t.method}" for t in table.itertuples()]
        table["relative_error_within_horizon"] = [
            _error_within(file[f"models/{model}/{motion}"], displacement, end) for model in models
        ]
    return table


def _error_within(run, displacement: np.ndarray, end: int) -> float | None:
    """Relative error over the frames before ``end``; None if the run did not get there."""
    return error_within(run["difference"], displacement, end) if "difference" in run else None


def _with_times(table: pd.DataFrame, paths: Iterable[str]) -> pd.DataFrame:
    """``table`` with the times of each row; the speed-up is against the compiled full order."""
    times = pd.concat([read_table(path) for path in paths], ignore_index=True)
    full = times[times.method.isna() & (times.implementation == "compiled")]
    reference = full.set_index("scene").ms_per_frame
    reduced = times[times.method.notna()].copy()
    reduced["position_basis"] = reduced.position_basis.fillna("full")
    reduced["local_ms"] += reduced.assembly_ms + reduced.lift_ms
    reduced["speedup"] = reduced.scene.map(reference) / reduced.ms_per_frame
    measured = ["ms_per_frame", "local_ms", "global_ms", "speedup"]
    inside = reduced.position_basis != "full"
    keys = [k for k in KEYS if k != "k"]
    local = table[table.position_basis == "full"].merge(
        reduced.loc[~inside, keys + measured], on=keys, how="left"
    )
    # the timing of a subspace model is found by its size k, its r is the element count
    keys = [k for k in KEYS if k != "r"]
    hyper = table[table.position_basis != "full"]
    if len(hyper) == 0:
        return local
    times_inside = reduced.loc[inside, keys + measured].astype({"k": "int64"})
    hyper = hyper.astype({"k": "int64"}).merge(times_inside, on=keys, how="left")
    return pd.concat([local, hyper], ignore_index=True)
