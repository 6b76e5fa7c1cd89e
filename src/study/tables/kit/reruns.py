"""Reruns of all motions with their errors, horizons and floors."""

from collections.abc import Mapping, Sequence
from typing import Any

import h5py
import pandas as pd

from pdrom.core.store import open_hdf5, read_table
from pdrom.reduction.deviations import DEVIATIONS, ERRORS, REFERENCE, Series, errors_within
from study.artifact.paths import File
from study.experiments.kit.horizon import floor_of, horizons
from study.tables.kit.vocabulary import (
    BLOWUP_FRAME,
    CONTACT_DELAY,
    ENERGY_DRIFT,
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
    RELATIVE_SHAPE_ERROR,
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
# of the same frames
USERS = (VELOCITY_ERROR, RELATIVE_SHAPE_ERROR, ENERGY_DRIFT, CONTACT_DELAY)
MEASURES = (ERROR_OVER_EXTENT, SHAPE_ERROR, *USERS)
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
    sensitivity, perturbation, threshold : see `horizons`
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
        reference = {series: store[series][...] for series in REFERENCE}
        table = table.assign(**_errors(runs, reference, end, file.attrs))
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
        reference = {series: file[f"{series}/{motion}"][...] for series in REFERENCE}
        table = table.assign(**_errors(runs, reference, end, file.attrs))
    return table


def _errors(
    runs: Sequence[h5py.Group], reference: Series, end: int, units: Mapping[str, Any]
) -> dict[str, list[float | None]]:
    """Errors before the horizon; a run of a size beyond the rank has no frames and no errors."""
    known = {unit: float(units[unit]) for unit in ("extent_norm", "time_step")}
    found = [
        errors_within({series: run[series][...] for series in DEVIATIONS}, reference, end, **known)
        if "difference" in run
        else dict.fromkeys(ERRORS)
        for run in runs
    ]
    return {name: [errors[name] for errors in found] for name in ERRORS}
