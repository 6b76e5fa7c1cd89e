"""Table stability: where each method can be trusted, over scenes, sizes, time step, stiffness."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.core.store import open_hdf5, read_table
from pdrom.tables.columns import conform

OUTCOMES = ("accurate", "wrong", "left the scene", "blow-up", "not run", "not judged")
KEYS = ["scene", "group", "method", "position_basis", "k", "r"]
SETTING = ["experiment", "scene", "h", "stiffness_ratio"]


def stability(
    full_order: Iterable[str],
    reruns: Iterable[str],
    hyper: Iterable[str],
    sweeps: Iterable[str],
    reduced_reruns: pd.DataFrame,
    time_steps: Mapping[str, float],
    wrong: float,
    left: float,
) -> pd.DataFrame:
    """Rows of the study's reruns (experiment "rerun"), then of the short runs ("sweep").

    What the guard saw (first frame and reason, number of frames) is known for reruns with unreduced
    positions; nobody watches the others.

    Method "full" with position basis "full" is the full-order run. The error of a rerun is the one
    within the horizon, that of a short run is over all of it.

    Parameters
    ----------
    full_order, reruns, hyper, sweeps : files ``fom/{scene}/train.h5``, ``reruns/{scene}/{group}/
        {method}.csv``, ``hyper/{scene}/models.csv`` and ``stability/{scene}.csv``
    time_steps : scene -> h in seconds
    wrong, left : see `pdrom.pipeline.study.Stability`
    """
    runs = pd.concat(
        [_full_order_rows(full_order), _rerun_rows(reruns, hyper, reduced_reruns)],
        ignore_index=True,
    )
    runs = runs.assign(h=runs.scene.map(time_steps), stiffness_ratio=1.0, experiment="rerun")
    parts = [runs, *(read_table(path).assign(experiment="sweep") for path in sweeps)]
    table = pd.concat(parts, ignore_index=True)
    # a file in which nothing ran brings a column of floats
    flags = [None if pd.isna(cell) else bool(cell) for cell in table.finite]
    table["finite"] = pd.array(flags, dtype="boolean")
    for column in ("k", "r", "blowup_frame", "guard_frame", "guard_count"):
        table[column] = table[column].astype("Int64")
    table["outcome"] = outcomes(table, wrong, left)
    return conform(table, "stability")


def outcomes(table: pd.DataFrame, wrong: float, left: float) -> list[str]:
    """One of `OUTCOMES` for each row; needs the full-order row of every setting."""
    full = table[(table.method == "full") & (table.position_basis == "full")]
    extents = full.set_index(SETTING).max_extent.to_dict()
    return [
        _outcome(row, extents[tuple(getattr(row, key) for key in SETTING)], wrong, left)
        for row in table.itertuples()
    ]


def _outcome(row, full_extent: float, wrong: float, left: float) -> str:
    if pd.isna(row.finite):
        return "not run"
    if not row.finite:
        return "blow-up"
    if row.max_extent > left * full_extent:
        return "left the scene"
    if pd.isna(row.relative_error):
        return "not judged"
    return "wrong" if row.relative_error > wrong else "accurate"


def _full_order_rows(paths: Iterable[str]) -> pd.DataFrame:
    """The full-order runs themselves; their energy ratio is one by definition."""
    rows = []
    for path in paths:
        with open_hdf5(path) as file:
            extents = np.ptp(file["positions"][...], axis=1).max(axis=1)
        rows.append(
            {
                "scene": Path(path).parent.name,
                "method": "full",
                "position_basis": "full",
                "finite": bool(np.isfinite(extents).all()),
                "max_extent": float(extents[1:].max() / extents[0]),
                "energy_ratio": 1.0,
                "relative_error": 0.0,
            }
        )
    return pd.DataFrame(rows)


def _rerun_rows(
    reruns: Iterable[str], hyper: Iterable[str], reduced_reruns: pd.DataFrame
) -> pd.DataFrame:
    """Reruns with their energy ratio and gain, and with the error that reduced_reruns judges by."""
    local = [read_table(path).assign(position_basis="full") for path in reruns]
    table = pd.concat([*local, *(read_table(path) for path in hyper)], ignore_index=True)
    table = table.drop(columns="relative_error")
    errors = reduced_reruns[[*KEYS, "relative_error_within_horizon"]]
    errors = errors.rename(columns={"relative_error_within_horizon": "relative_error"})
    if "k" not in table:
        table["k"] = np.nan
    return _with_plain_keys(table).merge(
        _with_plain_keys(errors), on=KEYS, how="left", validate="one_to_one"
    )


def _with_plain_keys(table: pd.DataFrame) -> pd.DataFrame:
    """``k`` and ``r`` as nullable integers on both sides of a merge."""
    return table.astype({"k": "Int64", "r": "Int64"})
