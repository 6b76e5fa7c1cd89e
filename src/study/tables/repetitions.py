"""Table repetitions: how far runs scatter that differ in what nobody means to choose."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import GROUP, METHOD, SCENE, R

_CELL = ["scene", "group", "method", "r", "varied"]


@table(
    title="Repeated runs: other training frames, moved starts",
    columns=(
        SCENE,
        GROUP,
        METHOD,
        R,
        text("varied", "what differs: training (frames), start"),
        integer("repetitions", "runs; their range encloses the median of all but by 2^(1 - n)"),
        compared(
            "error", integer("ended", "runs that ended before the horizon, with an infinite error")
        ),
        number("error_median", "median of the errors of the positions before the horizon"),
        number("error_low", "the least of them"),
        number("error_high", "the largest"),
        number("gain_median", "median of the gains"),
        number("gain_low", "the least of them"),
        number("gain_high", "the largest"),
        compared("error", number("spread", "largest error over least")),
    ),
    reads={"parts": Every(paths.REPETITIONS)},
)
def repetitions(parts: list[File]) -> pd.DataFrame:
    """One row per repeated run of ``parts``, over its repetitions.

    The range of n independent draws lies on one side of their distribution's median with the
    probability 2^(1 - n): five draws enclose it with 15/16, whatever the distribution is.
    """
    rows = joined(parts)
    if rows.empty:
        return rows
    cells = rows.groupby(_CELL, sort=False)
    made = cells.agg(
        repetitions=("error", "size"),
        error_median=("error", "median"),
        error_low=("error", "min"),
        error_high=("error", "max"),
        gain_median=("gain", "median"),
        gain_low=("gain", "min"),
        gain_high=("gain", "max"),
    )
    made["ended"] = rows.error.isin([float("inf")]).groupby([rows[c] for c in _CELL]).sum()
    return made.assign(spread=made.error_high / made.error_low).reset_index()
