"""Table ladder: every rung on every group that climbs it, with its error within the horizon."""

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from pdrom.store import open_hdf5, read_table
from pdrom.tables.columns import COLUMNS, conform
from pdrom.tables.reduced_reruns import error_within
from pdrom.tables.sensitivity import horizons


def ladder(
    paths: Iterable[str], sensitivity: pd.DataFrame, perturbation: float, threshold: float
) -> pd.DataFrame:
    """Rows of the files ``.../{scene}/{group}.h5``, in order; empty if there is none.

    Each has a table of the same name beside it. The error within the horizon uses the frames before
    it only; a run that blew up before has none.
    """
    ends = horizons(sensitivity, perturbation, threshold)
    parts = [_climb(Path(path), ends) for path in paths]
    if not parts:
        return pd.DataFrame(columns=COLUMNS["ladder"])
    table = pd.concat(parts, ignore_index=True)
    for column in ("r", "blowup_frame"):
        table[column] = table[column].astype("Int64")
    table["finite"] = table["finite"].astype("boolean")
    return conform(table, "ladder")


def _climb(path: Path, ends: dict[str, int]) -> pd.DataFrame:
    table = read_table(path.with_suffix(".csv"))
    end = ends[path.parent.name]
    with open_hdf5(path) as file:
        displacement = file["displacement"][...]
        errors = [error_within(file[str(i)], displacement, end) for i in range(len(table))]
    return table.assign(relative_error_within_horizon=pd.Series(errors, dtype=float))
