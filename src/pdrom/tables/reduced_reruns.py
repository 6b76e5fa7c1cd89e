"""Table reduced_reruns: errors of the reruns, over the run and within the horizon, with times."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.metrics import trajectory_error
from pdrom.store import open_hdf5, read_table
from pdrom.tables.columns import conform
from pdrom.tables.sensitivity import floor_of, horizons


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
    subspaces ``.../{scene}.h5``, each with a table of the same name beside it. In a subspace all
    groups are reduced, and r counts the evaluated elements. The error within the horizon uses the
    frames before the horizon only; a run that blew up before has none.
    """
    ends = horizons(sensitivity, perturbation, threshold)
    parts = [_local_only(path, ends) for path in reruns] + [_subspace(path, ends) for path in hyper]
    table = pd.concat(parts, ignore_index=True)
    table["horizon_frame"] = table.scene.map(ends)
    floors = {s: floor_of(sensitivity, s, perturbation)[:end] for s, end in ends.items()}
    table["sensitivity_floor"] = table.scene.map(
        {scene: float(floor.max(initial=0.0)) for scene, floor in floors.items()}
    )
    table = _with_times(table, timings)
    for column in ("k", "r", "frames", "blowup_frame", "horizon_frame"):
        table[column] = table[column].astype("Int64")
    table["finite"] = table["finite"].astype("boolean")
    return conform(table, "reduced_reruns")


def _local_only(path: str, ends: dict[str, int]) -> pd.DataFrame:
    """Rows of runs whose positions are not reduced."""
    table = read_table(Path(path).with_suffix(".csv"))
    end = ends[Path(path).parent.parent.name]
    with open_hdf5(path) as file:
        displacement = file["displacement"][...]
        table["relative_error_within_horizon"] = [
            _error_within(file[f"r{r:04d}"], displacement, end) for r in table.r
        ]
    return table.assign(position_basis="full", k=None)


def _subspace(path: str, ends: dict[str, int]) -> pd.DataFrame:
    """Rows of runs in position subspaces."""
    table = read_table(Path(path).with_suffix(".csv"))
    end = ends[Path(path).stem]
    with open_hdf5(path) as file:
        displacement = file["displacement"][...]
        table["relative_error_within_horizon"] = [
            _error_within(
                file[f"models/{row.position_basis}_k{row.k:03d}_{row.method}"], displacement, end
            )
            for row in table.itertuples()
        ]
    return table


def _error_within(run, displacement: np.ndarray, end: int) -> float | None:
    """Relative error over the frames before ``end``; None if the run did not get there."""
    if "difference" not in run or len(run["difference"]) < end:
        return None
    return trajectory_error(run["difference"][:end], displacement[:end])


def _with_times(table: pd.DataFrame, paths: Iterable[str]) -> pd.DataFrame:
    """``table`` with the times of each row; the speed-up is against the compiled full order."""
    times = pd.concat([read_table(path) for path in paths], ignore_index=True)
    full = times[times.method.isna() & (times.implementation == "compiled")]
    reference = full.set_index("scene").ms_per_frame
    reduced = times[times.method.notna()].copy()
    reduced["position_basis"] = reduced.position_basis.fillna("full")
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
