"""Selections from the table reduced_reruns by motion, and medians over held-out motions.

Errors over held-out motions are summarised by their median, as fixed in config/claims.yaml.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from study.tables.kit.declaration import integer, number

KEYS = ["scene", "group", "method", "position_basis", "k", "r"]  # columns that identify a run
TRAIN = "train"
MEDIAN, LOW, HIGH, COUNT = "error_heldout", "error_heldout_low", "error_heldout_high", "motions"
COLUMNS = (
    number(MEDIAN, "the same error on held-out motions: their median; inf where a run ended"),
    number(LOW, "the least of them"),
    number(HIGH, "the largest"),
    integer(COUNT, "held-out motions that were run, can be judged and are far enough"),
    number("playback_error", "median error of playback on these motions, see reduced_reruns"),
)
# A held-out motion is a test only where playback has a larger error than this.
FAR = 0.3
_WHOLE = {"k": "Int64", "r": "Int64"}
EXPERIMENT = ["scene", "group"]
ORTHOGONAL = "pod"  # orthogonal projection, which evaluates all elements
FAILED = 0.1  # error within the horizon above which a run counts as failed
TWIN = "_twin"


def families(scenes: pd.Series) -> pd.Series:
    """Family of each scene: its name without the suffix `TWIN` of a scene's variant."""
    return scenes.str.removesuffix(TWIN)


def trained(reruns: pd.DataFrame) -> pd.DataFrame:
    """Rows of the table reduced_reruns (``reruns``) for the training motion."""
    return reruns[reruns.motion == TRAIN]


def over_motions(reruns: pd.DataFrame, keys: Sequence[str] = KEYS) -> pd.DataFrame:
    """Median, least and largest error of each run over its held-out motions, and their number.

    A run that ended before the horizon has an infinite error. Sizes above the numerical rank, which
    cannot run, and motions whose horizon is frame 0 or that playback nearly meets (`FAR`) are left
    out.

    Parameters
    ----------
    reruns : table reduced_reruns
    keys : columns that identify a run
    """
    ran = (reruns.frames > 0) | reruns.blowup_frame.notna()
    tests = (reruns.horizon_frame > 0) & (reruns.playback_error > FAR)
    rows = reruns[(reruns.motion != TRAIN) & ran & tests]
    rows = rows.astype({key: kind for key, kind in _WHOLE.items() if key in keys})
    error = rows.relative_error_within_horizon.astype(float).fillna(np.inf)
    own = [rows[key] for key in keys]
    runs = error.groupby(own, sort=False, dropna=False)
    made = runs.agg(**{MEDIAN: "median", LOW: "min", HIGH: "max", COUNT: "count"})
    playback = rows.playback_error.groupby(own, sort=False, dropna=False).median()
    return made.join(playback).reset_index()


def with_held_out(runs: pd.DataFrame, reruns: pd.DataFrame) -> pd.DataFrame:
    """``runs`` with the columns of `over_motions` of ``reruns``, empty where it lacks the run."""
    own = runs.astype(_WHOLE).drop(columns="playback_error", errors="ignore")
    return own.merge(over_motions(reruns), on=KEYS, how="left")


def judged_runs(reruns: pd.DataFrame, reconstruction: pd.DataFrame) -> pd.DataFrame:
    """Training-motion runs of sampled methods with unreduced positions and a sufficient basis.

    A basis suffices where the run with orthogonal projection has an error of at most `FAILED`. The
    result has the columns of ``reruns`` and

    gain : gain of the reduction
    error : error of the run within the horizon; inf if it blew up before
    orthogonal_error : error of orthogonal projection at its largest size up to r (bases without
        centring have one mode more)
    failed : whether the error exceeds `FAILED`
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
