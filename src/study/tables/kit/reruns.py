"""Runs of the table reduced_reruns: training and held-out motions, the gain of their reductions.

Over the held-out motions each run has one number, by a rule fixed in config/claims.yaml.
"""

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
EXPERIMENT = ["scene", "group"]
ORTHOGONAL = "pod"  # the method that evaluates and projects everything
FAILED = 0.1  # error within the horizon above which a run counts as failed
TWIN = "_twin"


def families(scenes: pd.Series) -> pd.Series:
    """Family of each scene: its name, or that of the scene that it is the twin of."""
    return scenes.str.removesuffix(TWIN)


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


def judged_runs(reruns: pd.DataFrame, reconstruction: pd.DataFrame) -> pd.DataFrame:
    """Training runs of sampled methods, with unreduced positions, whose basis suffices.

    It suffices where the orthogonal projection on it does not fail. The columns are those of
    ``reruns``, and

    gain : of the reduction
    error : of the run within the horizon; inf if it ended before
    orthogonal_error : the same of the orthogonal projection at the largest size up to r (bases
        without centring have one mode more)
    failed : the run ended before the horizon or its error there exceeds `FAILED`
    """
    runs = trained(reruns)
    runs = runs[(runs.position_basis == "full") & runs.max_extent.notna()].copy()
    ended = runs.relative_error_within_horizon.isna() & runs.blowup_frame.notna()
    runs["error"] = runs.relative_error_within_horizon.where(~ended, np.inf)
    keys = [*EXPERIMENT, "method", "r"]
    train = reconstruction[reconstruction.split == "train"]
    runs = runs.merge(train[[*keys, "gain"]], on=keys, how="left").astype({"r": "int64"})
    orthogonal = runs.loc[runs.method == ORTHOGONAL, [*EXPERIMENT, "r", "error"]]
    orthogonal = orthogonal.rename(columns={"error": "orthogonal_error"})
    order = runs.assign(place=range(len(runs))).sort_values("r", kind="stable")
    paired = pd.merge_asof(order, orthogonal.sort_values("r"), on="r", by=EXPERIMENT)
    runs = paired.sort_values("place").drop(columns="place").reset_index(drop=True)
    fine = (runs.orthogonal_error <= FAILED) & (runs.method != ORTHOGONAL) & runs.error.notna()
    runs = runs[fine & runs.gain.notna()].copy()
    runs["failed"] = runs.error > FAILED
    return runs
