"""Table reduced_reruns: errors of the reruns, over the run and within the horizon, with times."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.metrics import trajectory_error
from pdrom.store import open_hdf5, read_table
from pdrom.tables.columns import conform
from pdrom.tables.sensitivity import floor_of, horizons


def reduced_reruns(
    reruns: Iterable[str],
    timings: Iterable[str],
    sensitivity: pd.DataFrame,
    perturbation: float,
    threshold: float,
) -> pd.DataFrame:
    """One row per scene, group, method and r.

    ``reruns`` are the HDF5 files ``.../{scene}/{group}/{method}.h5`` with a table of the same name
    beside them. The error within the horizon uses the frames before the horizon only; a run that
    blew up before has none.
    """
    ends = horizons(sensitivity, perturbation, threshold)
    parts = [_with_horizon(path, ends, sensitivity, perturbation) for path in reruns]
    table = pd.concat(parts, ignore_index=True)
    table = table.merge(_times(timings), on=["scene", "group", "method", "r"], how="left")
    table["position_basis"] = "full"
    table["k"] = None
    for column in ("r", "frames", "blowup_frame", "horizon_frame"):
        table[column] = table[column].astype("Int64")
    table["finite"] = table["finite"].astype("boolean")
    return conform(table, "reduced_reruns")


def _with_horizon(
    path: str, ends: dict[str, int], sensitivity: pd.DataFrame, perturbation: float
) -> pd.DataFrame:
    table = read_table(Path(path).with_suffix(".csv"))
    scene = Path(path).parent.parent.name
    end = ends[scene]
    floor = floor_of(sensitivity, scene, perturbation)
    with open_hdf5(path) as file:
        displacement = file["displacement"][...]
        table["relative_error_within_horizon"] = [
            _error_within(file[f"r{r:04d}"], displacement, end) for r in table.r
        ]
    table["horizon_frame"] = end
    table["sensitivity_floor"] = float(floor[:end].max(initial=0.0))
    return table


def _error_within(run, displacement: np.ndarray, end: int) -> float | None:
    """Relative error over the frames before ``end``; None if the run did not get there."""
    if "difference" not in run or len(run["difference"]) < end:
        return None
    return trajectory_error(run["difference"][:end], displacement[:end])


def _times(paths: Iterable[str]) -> pd.DataFrame:
    table = pd.concat([read_table(path) for path in paths], ignore_index=True)
    full = table[table.method.isna() & (table.implementation == "compiled")]
    reference = full.set_index("scene").ms_per_frame
    reduced = table[table.method.notna()].copy()
    reduced["speedup"] = reduced.scene.map(reference) / reduced.ms_per_frame
    columns = ["scene", "group", "method", "r", "ms_per_frame", "local_ms", "global_ms", "speedup"]
    return reduced[columns]
