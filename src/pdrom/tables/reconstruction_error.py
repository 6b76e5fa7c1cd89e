"""Table reconstruction_error: all methods, sizes and splits."""

from collections.abc import Iterable

import pandas as pd

from pdrom.core.store import read_table
from pdrom.tables.columns import conform


def reconstruction_error(paths: Iterable[str]) -> pd.DataFrame:
    """Concatenation of the per-method files, in order."""
    table = pd.concat([read_table(path) for path in paths], ignore_index=True)
    for column in ("rows_sampled", "elements_sampled"):
        table[column] = table[column].astype("Int64")
    return conform(table, "reconstruction_error")
