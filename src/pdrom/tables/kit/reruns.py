"""Reruns of all motions with their errors, horizons and floors."""

from collections.abc import Callable, Sequence

import h5py
import numpy as np
import pandas as pd

from pdrom.core.paths import File
from pdrom.core.store import open_hdf5, read_table
from pdrom.experiments.kit.horizon import error_within, floor_of, horizons, rms_within
from pdrom.tables.kit.vocabulary import (
    BLOWUP_FRAME,
    ERROR_OVER_EXTENT,
    ERROR_WITHIN,
    FINITE,
    FLOOR,
    FRAMES,
    GROUP,
    HORIZON_FRAME,
    MAX_EXTENT,
    METHOD,
    POSITION_BASIS,
    RELATIVE_ERROR,
    SCENE,
    SHAPE_ERROR,
    VELOCITY_ERROR,
    K,
    R,
)

COLUMNS = (
    SCENE, GROUP, METHOD, POSITION_BASIS, K, R, FRAMES, FINITE, BLOWUP_FRAME, MAX_EXTENT,
    RELATIVE_ERROR, ERROR_WITHIN, HORIZON_FRAME, FLOOR,
)  # fmt: skip
MEASURES = (ERROR_OVER_EXTENT, SHAPE_ERROR, VELOCITY_ERROR)  # of the same frames
KEYS = ["scene", "group", "method", "position_basis", "k", "r"]  # what tells runs apart
TRAIN = "train"


def judged_reruns(
    runs: list[File],
    rows: list[File],
    subspaces: list[File],
    subspace_rows: list[File],
    sensitivity: pd.DataFrame,
    perturbation: float | str,
    threshold: float,
    motion: str,
) -> pd.DataFrame:
    """One row per scene, group, method and r, then the runs in position subspaces.

    In a subspace all groups are reduced, and r counts the evaluated elements. The error within the
    horizon uses the frames before it only; a run that blew up before has none.

    Parameters
    ----------
    runs, rows : HDF5 files of the runs and their tables of the motion, in the same order
    subspaces, subspace_rows : the same in position subspaces
    motion : "train" or a held-out one, whose rows are chosen from all of the tables
    """
    ends = horizons(sensitivity, perturbation, threshold)
    parts = [_local_only(run, row, ends, motion) for run, row in zip(runs, rows, strict=True)]
    inside = zip(subspaces, subspace_rows, strict=True)
    parts += [_subspace(run, row, ends, motion) for run, row in inside]
    table = pd.concat(parts, ignore_index=True)
    table["horizon_frame"] = table.scene.map(ends)
    floors = {s: floor_of(sensitivity, s, perturbation)[:end] for s, end in ends.items()}
    table["sensitivity_floor"] = table.scene.map(
        {scene: float(floor.max(initial=0.0)) for scene, floor in floors.items()}
    )
    return table


def _local_only(run: File, row: File, ends: dict[str, int], motion: str) -> pd.DataFrame:
    """Rows of runs whose positions are not reduced."""
    table, end = _of_motion(row, motion), ends[run["scene"]]
    with open_hdf5(run.path) as file:
        store = file if motion == TRAIN else file[motion]
        runs = [store[f"r{r:04d}"] for r in table.r]
        displacement, step = store["displacement"][...], store["step"][...]
        extent_norm = file.attrs["extent_norm"]
        table = table.assign(**_errors(runs, displacement, step, extent_norm, end))
    return table.assign(position_basis="full", k=None)


def _of_motion(row: File, motion: str) -> pd.DataFrame:
    """Rows of a motion; a table of training runs has no column that names one."""
    table = read_table(row.path)
    return table if motion == TRAIN else table[table.motion == motion]


def _subspace(run: File, row: File, ends: dict[str, int], motion: str) -> pd.DataFrame:
    """Rows of runs in position subspaces."""
    table, end = _of_motion(row, motion), ends[run["scene"]]
    with open_hdf5(run.path) as file:
        models = [f"{t.position_basis}_k{t.k:03d}_{t.method}" for t in table.itertuples()]
        runs = [file[f"models/{model}/{motion}"] for model in models]
        displacement, step = file[f"displacement/{motion}"][...], file[f"step/{motion}"][...]
        extent_norm = file.attrs["extent_norm"]
        table = table.assign(**_errors(runs, displacement, step, extent_norm, end))
    return table


def _errors(
    runs: Sequence[h5py.Group],
    displacement: np.ndarray,
    step: np.ndarray,
    extent_norm: float,
    end: int,
) -> dict[str, list[float | None]]:
    """Errors before the horizon; a run of a size beyond the rank has no frames and no errors."""

    def each(series: str, error: Callable[[np.ndarray], float | None]) -> list[float | None]:
        return [error(run[series][...]) if series in run else None for run in runs]

    def over_extent(difference: np.ndarray) -> float | None:
        return rms_within(difference, extent_norm, end)

    return {
        "relative_error_within_horizon": each(
            "difference", lambda difference: error_within(difference, displacement, end)
        ),
        "error_over_extent": each("difference", over_extent),
        "shape_error": each("shape_difference", over_extent),
        "velocity_error": each("step_difference", lambda apart: error_within(apart, step, end)),
    }
