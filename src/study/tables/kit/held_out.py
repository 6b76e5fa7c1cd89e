"""Motions of the reruns: the training one, and one error for each run over the held-out ones."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from study.tables.kit.declaration import integer, number

KEYS = ["scene", "group", "method", "position_basis", "k", "r"]  # what tells runs apart
TRAIN = "train"
MEDIAN, LOW, HIGH, COUNT = "error_heldout", "error_heldout_low", "error_heldout_high", "motions"
COLUMNS = (
    number(MEDIAN, "the same error on held-out motions: their median; inf where a run ended"),
    number(LOW, "the least of them"),
    number(HIGH, "the largest"),
    integer(COUNT, "held-out motions that were run and can be judged"),
)
_WHOLE = {"k": "Int64", "r": "Int64"}


def trained(reruns: pd.DataFrame) -> pd.DataFrame:
    """Runs of the training motion of the table ``reruns``, reduced_reruns."""
    return reruns[reruns.motion == TRAIN]


def over_motions(reruns: pd.DataFrame, keys: Sequence[str] = KEYS) -> pd.DataFrame:
    """Median, least and largest error of each run over its held-out motions, and their number.

    A run that ended before the horizon has an infinite error. A size beyond the rank was not run,
    and a motion whose horizon is its start judges nothing: both are left out.

    Parameters
    ----------
    reruns : table reduced_reruns
    keys : columns that tell runs apart
    """
    ran = (reruns.frames > 0) | reruns.blowup_frame.notna()
    rows = reruns[(reruns.motion != TRAIN) & ran & (reruns.horizon_frame > 0)]
    rows = rows.astype({key: kind for key, kind in _WHOLE.items() if key in keys})
    error = rows.relative_error_within_horizon.astype(float).fillna(np.inf)
    runs = error.groupby([rows[key] for key in keys], sort=False, dropna=False)
    made = runs.agg(**{MEDIAN: "median", LOW: "min", HIGH: "max", COUNT: "count"})
    return made.reset_index()


def with_held_out(runs: pd.DataFrame, reruns: pd.DataFrame) -> pd.DataFrame:
    """``runs`` with the columns of `over_motions` of ``reruns``, empty where it lacks the run."""
    return runs.astype(_WHOLE).merge(over_motions(reruns), on=KEYS, how="left")
