"""Table kernel_accuracy: the compiled projections against high precision."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import ROUNDING


@table(
    title="Accuracy of the compiled projections",
    columns=(
        text("group", "constraint group of the projection"),
        text("matrix_class", "kind of matrices that are projected"),
        integer("cases", "matrices of the class"),
        number("condition", "largest condition number of the projection at them"),
        compared("skipped", number("worst_relative_error", "largest relative error")),
        compared(
            "share",
            number("worst_over_condition", "largest relative error over its condition number"),
            ROUNDING,
        ),
    ),
    reads={"parts": Every(paths.KERNEL_ACCURACY)},
)
def kernel_accuracy(parts: list[File]) -> pd.DataFrame:
    """Rows of ``parts`` by group and class."""
    return joined(parts)
