"""Table ladder: every rung on every scene that climbs it."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import BLOWUP_FRAME, ERROR_WITHIN, FINITE, GAIN, GROUP, SCENE, R


@table(
    title="From the published choices to sound ones, one at a time",
    columns=(
        SCENE,
        GROUP,
        text(
            "direction",
            "up from published choices, down from sound ones, signs of the modes, square: "
            "coefficients by samples",
        ),
        text("rung", "choice that changes on this rung"),
        integer("rows_per_element", "rows of an element"),
        compared("value", integer("entries", "sampled entries that determine the coefficients")),
        R,
        compared("value", number("condition", "condition number of the sampled modes")),
        GAIN,
        number("error_train", "reconstruction error of the training snapshots"),
        number("error_test", "the same of the snapshots between them"),
        number("error_heldout", "the same of the held-out motion"),
        FINITE,
        BLOWUP_FRAME,
        ERROR_WITHIN,
        integer("repetitions", "runs trained on other frames, where they were repeated"),
        number("error_median", "median of their errors before the horizon"),
        number("error_low", "the least of them"),
        number("error_high", "the largest; inf for a run that ended earlier"),
        number("gain_low", "the least of their gains"),
        number("gain_high", "the largest"),
    ),
    reads={"parts": Every(paths.LADDER)},
)
def ladder(parts: list[File]) -> pd.DataFrame:
    """Rows of all scenes, in the order of their ``parts``."""
    return joined(parts)
