"""Reruns with positions unreduced, with the gain and the errors of their reduction."""

import numpy as np
import pandas as pd

from study.tables.kit.held_out import trained

EXPERIMENT = ["scene", "group"]
ORTHOGONAL = "pod"  # the method that evaluates and projects everything
FAILED = 0.1  # error within the horizon above which a run counts as failed
_TRAINING = ["gain", "elements_sampled", "relative_error"]


def reruns_with_gain(reruns: pd.DataFrame, reconstruction: pd.DataFrame) -> pd.DataFrame:
    """Training runs of ``reruns`` that reduce projections only, with three sorts of columns.

    gain, elements_sampled, reconstruction_error : of the reduction, on the training snapshots
    elements : all elements of the group
    error : of the run within the horizon; inf if it ended before, nan where there was no run
    orthogonal_error, orthogonal_reconstruction : the same of the orthogonal projection at the
        largest size up to r (bases without centring have one mode more); nan if it was not run
    """
    runs = trained(reruns)
    runs = runs[(runs.position_basis == "full") & runs.max_extent.notna()].copy()
    ended = runs.relative_error_within_horizon.isna() & runs.blowup_frame.notna()
    runs["error"] = runs.relative_error_within_horizon.where(~ended, np.inf)
    train = reconstruction[reconstruction.split == "train"]
    keys = [*EXPERIMENT, "method", "r"]
    train = train[keys + _TRAINING].rename(columns={"relative_error": "reconstruction_error"})
    runs = runs.drop(columns="relative_error").merge(train, on=keys, how="left")
    runs["r"] = runs.r.astype("int64")
    orthogonal = runs.loc[
        runs.method == ORTHOGONAL,
        [*EXPERIMENT, "r", "error", "reconstruction_error", "elements_sampled"],
    ].rename(
        columns={
            "error": "orthogonal_error",
            "reconstruction_error": "orthogonal_reconstruction",
            "elements_sampled": "elements",
        }
    )
    order = runs.assign(place=range(len(runs))).sort_values("r", kind="stable")
    paired = pd.merge_asof(order, orthogonal.sort_values("r"), on="r", by=EXPERIMENT)
    return paired.sort_values("place").drop(columns="place").reset_index(drop=True)


def judged_runs(reruns: pd.DataFrame, reconstruction: pd.DataFrame) -> pd.DataFrame:
    """Runs of sampled methods whose basis suffices, with the columns of `reruns_with_gain`.

    The basis suffices where the orthogonal projection on it does not fail. ``failed`` marks runs
    that end before the horizon or whose error there exceeds `FAILED`.
    """
    runs = reruns_with_gain(reruns, reconstruction)
    fine = (runs.orthogonal_error <= FAILED) & (runs.method != ORTHOGONAL) & runs.error.notna()
    runs = runs[fine & runs.gain.notna()].copy()
    runs["failed"] = runs.error > FAILED
    return runs
