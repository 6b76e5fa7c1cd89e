"""Table published_distance: how far each choice leaves the errors from the published code's."""

import numpy as np
import pandas as pd

from study.artifact.reads import TableOf
from study.tables.kit.declaration import compared, integer, number, table
from study.tables.kit.vocabulary import GROUP, SCENE
from study.tables.published_choices import CHOICE, DIRECTION

KEYS = ["scene", "group", "direction", "choice"]
AGREE = np.log10(1.01)


@table(
    title="Distance to the output of the published code",
    columns=(
        SCENE,
        GROUP,
        DIRECTION,
        CHOICE,
        integer("sizes", "numbers of modes that are compared, on each axis that moves"),
        compared(
            "skipped",
            number("distance", "decades between the errors, median over sizes and axes"),
        ),
        compared("skipped", number("largest", "the largest of these")),
        compared(
            "skipped",
            integer("met", "modes up to which all errors agree within one per cent; 0: none"),
        ),
    ),
    reads={"errors": TableOf("published_choices")},
)
def published_distance(errors: pd.DataFrame) -> pd.DataFrame:
    """One row per variant of ``errors``, the table published_choices, in order."""
    rows = [
        {**dict(zip(KEYS, key, strict=True)), **_distance(rows)}
        for key, rows in errors.groupby(KEYS, sort=False)
    ]
    return pd.DataFrame(rows)


def _distance(rows: pd.DataFrame) -> dict[str, float]:
    decades = rows.log_ratio.abs()
    return {
        "sizes": rows.r.nunique(),
        "distance": decades.median(),
        "largest": decades.max(),
        "met": _met(decades.groupby(rows.r).max()),
    }


def _met(largest: pd.Series) -> int:
    """The last of the sizes, from the smallest on, at which every axis agrees."""
    agree = (largest <= AGREE).cummin()
    return int(agree.index[agree].max()) if agree.any() else 0
