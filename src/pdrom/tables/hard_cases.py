"""Table hard_cases: every reduction in every hard case."""

from collections.abc import Iterable
from typing import Any

import pandas as pd

from pdrom.tables.columns import COLUMNS


def hard_cases(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    """Rows in order, counts as integers.

    r is the basis size, in a position subspace the number of evaluated elements; max_extent is
    relative to the scale of the full-order run; objective_rise is the largest in one iteration,
    over the first value of its frame.
    """
    table = pd.DataFrame(rows, columns=COLUMNS["hard_cases"])
    for column in ("k", "r", "frames", "blowup_frame"):
        table[column] = table[column].astype("Int64")
    return table
