"""Reruns with positions unreduced, beside what their reduction says about itself."""

import numpy as np
import pandas as pd

EXPERIMENT = ["scene", "group"]
ORTHOGONAL = "pod"  # the method that evaluates and projects everything
_TRAINING = ["gain", "elements_sampled", "relative_error"]


def reruns_with_gain(reruns: pd.DataFrame, reconstruction: pd.DataFrame) -> pd.DataFrame:
    """Runs of ``reruns`` in which only projections are reduced, with three sorts of columns.

    gain, elements_sampled, reconstruction_error : of the reduction, on the training snapshots
    elements : all elements of the group
    error : of the run within the horizon; inf if it ended before, nan where there was no run
    orthogonal_error, orthogonal_reconstruction : the same of the orthogonal projection at the
        largest size up to r (bases without centring have one mode more); nan if it was not run
    """
    runs = reruns[(reruns.position_basis == "full") & (reruns.max_extent.notna())].copy()
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
