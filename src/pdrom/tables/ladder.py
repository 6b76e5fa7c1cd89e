"""Table ladder: every rung on every scene that climbs it."""

from collections.abc import Iterable

import pandas as pd

from pdrom.core.store import read_table
from pdrom.tables.columns import COLUMNS, conform


def ladder(paths: Iterable[str]) -> pd.DataFrame:
    """Concatenation of the per-scene files, in order; empty if there is none."""
    parts = [read_table(path) for path in paths]
    if not parts:
        return pd.DataFrame(columns=COLUMNS["ladder"])
    table = pd.concat(parts, ignore_index=True)
    table["blowup_frame"] = table["blowup_frame"].astype("Int64")
    return conform(table, "ladder")
