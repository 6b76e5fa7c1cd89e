"""Table hard_cases: every reduction in every hard case."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, flag, number, table, text
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import BLOWUP_FRAME, FINITE, FRAMES, GAIN, METHOD, K, R

# Share of the runs on degenerate meshes whose outcome rounding decides.
FRAGILE = 0.005


@table(
    title="Every reduction in every hard case",
    columns=(
        text("case", "name of the hard case"),
        METHOD,
        flag("bounded_projections", "no state makes projections of the reduced group large"),
        K,
        R,
        GAIN,
        FRAMES,
        compared("error", FINITE, FRAGILE),
        BLOWUP_FRAME,
        compared(
            "error", number("max_extent", "largest extent over the scale of the full-order run")
        ),
        compared(
            "skipped",
            number("objective_rise", "largest in one iteration, over the first value of its frame"),
        ),
        compared("error", text("outcome", "how the reduction fared"), FRAGILE),
        compared("error", text("why", "reason of a refusal or of an expected failure")),
    ),
    reads={"parts": Every(paths.HARD_CASES)},
)
def hard_cases(parts: list[File]) -> pd.DataFrame:
    """Rows of ``parts`` in the order of the cases and methods."""
    return joined(parts)
