"""Table offline_cost: time of the algorithms that run before a reduced model does."""

import pandas as pd

from pdrom.artifact.reads import Every
from pdrom.core import paths
from pdrom.core.paths import File
from pdrom.tables.kit.declaration import compared, integer, number, table, text, timed
from pdrom.tables.kit.parts import joined
from pdrom.tables.kit.vocabulary import ROUNDING


@table(
    title="Cost of the offline algorithms beside those of a library",
    columns=(
        text("task", "algorithm"),
        text("implementation", "whose: pdrom, pymor"),
        integer("rows", "rows of the matrix"),
        integer("columns", "columns of the matrix"),
        timed(number("seconds", "time that it took", "s")),
        compared(
            "share",
            number("difference", "of both results: relative, or the share of indices not in both"),
            ROUNDING,
        ),
    ),
    reads={"parts": Every(paths.OFFLINE)},
)
def offline_cost(parts: list[File]) -> pd.DataFrame:
    """Rows of ``parts`` by task and implementation."""
    return joined(parts)
