"""Table targets: who comes near the orthogonal projection, on scenes that can be judged."""

import numpy as np
import pandas as pd

from pdrom.tables.columns import conform
from pdrom.tables.joined import ORTHOGONAL, reruns_with_gain

FACTOR = 1.5  # of the orthogonal projection's error
SIZES_FROM = 20  # basis sizes for which the target is set


def targets(reruns: pd.DataFrame, reconstruction: pd.DataFrame) -> pd.DataFrame:
    """One row per run of a sampled method on a well-posed scene, compared with `ORTHOGONAL`.

    Well-posed: round-off does not decide the motion before the run ends. ``ratio`` is the error
    over that of the orthogonal projection, both not below the scene's sensitivity floor, under
    which errors cannot be compared; inf for a run that ended early. ``within`` is ratio <= FACTOR,
    ``asked`` r >= SIZES_FROM.
    ``spread`` is gain sqrt(elements_share): 1 if the sampled rows of the modes are as near to
    orthogonal as those of an even share of the mesh can be.
    """
    runs = reruns_with_gain(reruns, reconstruction)
    complete = runs[(runs.method == ORTHOGONAL) & runs.finite.fillna(False).astype(bool)]
    length = runs.scene.map(complete.groupby("scene").frames.max())
    judged = (runs.horizon_frame >= length) & runs.orthogonal_error.notna()
    table = runs[judged & (runs.method != ORTHOGONAL) & runs.error.notna()].copy()
    floor = table.sensitivity_floor
    table["ratio"] = np.maximum(table.error, floor) / np.maximum(table.orthogonal_error, floor)
    table["asked"] = table.r >= SIZES_FROM
    table["within"] = table.ratio <= FACTOR
    table["elements_share"] = table.elements_sampled.astype(float) / table.elements.astype(float)
    table["spread"] = table.gain * np.sqrt(table.elements_share)
    return conform(table, "targets")
