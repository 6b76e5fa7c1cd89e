"""Table targets: who comes near the orthogonal projection, on scenes that can be judged."""

import numpy as np
import pandas as pd

from study.artifact.reads import TableOf
from study.tables.kit.declaration import compared, flag, number, table
from study.tables.kit.gains import ORTHOGONAL, reruns_with_gain
from study.tables.kit.vocabulary import ELEMENTS_SAMPLED, GAIN, GROUP, METHOD, SCENE, R

FACTOR = 1.5  # of the orthogonal projection's error
SIZES_FROM = 20  # basis sizes for which the target is set


@table(
    title="Who comes near the orthogonal projection",
    columns=(
        SCENE,
        GROUP,
        METHOD,
        R,
        number("error", "of the run before the horizon; inf if it ended earlier"),
        number("orthogonal_error", "the same of the orthogonal projection at the same size"),
        compared(
            "error",
            number("ratio", "the first over the second, neither below the sensitivity floor"),
        ),
        flag("asked", f"r is at least {SIZES_FROM}, the sizes for which the target is set"),
        compared("error", flag("within", f"ratio is at most {FACTOR}, the target")),
        GAIN,
        ELEMENTS_SAMPLED,
        compared(
            "value", number("elements_share", "elements that are evaluated over all elements")
        ),
        compared("value", number("spread", "gain sqrt(elements_share)")),
    ),
    reads={"reruns": TableOf("reduced_reruns"), "reconstruction": TableOf("reconstruction_error")},
)
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
    rows = runs[judged & (runs.method != ORTHOGONAL) & runs.error.notna()].copy()
    floor = rows.sensitivity_floor
    rows["ratio"] = np.maximum(rows.error, floor) / np.maximum(rows.orthogonal_error, floor)
    rows["asked"] = rows.r >= SIZES_FROM
    rows["within"] = rows.ratio <= FACTOR
    rows["elements_share"] = rows.elements_sampled.astype(float) / rows.elements.astype(float)
    rows["spread"] = rows.gain * np.sqrt(rows.elements_share)
    return rows
