"""Table subspace_ablation: variants of block DEIM in position subspaces, all scenes."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import (
    ELEMENTS_SAMPLED,
    ERROR_WITHIN,
    FINITE,
    GAIN,
    MAX_EXTENT,
    POSITION_BASIS,
    SCENE,
    K,
)


@table(
    title="Variants of block DEIM in a position subspace",
    columns=(
        SCENE,
        text("group", "all groups of the scene"),
        POSITION_BASIS,
        K,
        integer("r", "modes of the projections of each group"),
        text("variant", "what differs from plain block DEIM"),
        ELEMENTS_SAMPLED,
        compared(
            "value",
            integer("control_elements", "elements of the safeguard, evaluated twice a frame"),
        ),
        compared(
            "error", number("fallback_share", "frames of the training motion that it repeats")
        ),
        compared("error", number("heldout_fallback_share", "the same of the held-out motions")),
        GAIN,
        FINITE,
        MAX_EXTENT,
        ERROR_WITHIN,
        number("relative_error_full_projections", "the same with all elements evaluated"),
        number(
            "heldout_error_within_horizon",
            "median of the errors of held-out motions before their horizons; inf where a run ended",
        ),
        number("heldout_error_low", "the least of them"),
        number("heldout_error_high", "the largest"),
        number("heldout_error_full_projections", "the median with all elements evaluated"),
    ),
    reads={"parts": Every(paths.SUBSPACE_ABLATION)},
)
def subspace_ablation(parts: list[File]) -> pd.DataFrame:
    """Rows of all scenes, in the order of their ``parts``."""
    return joined(parts)
