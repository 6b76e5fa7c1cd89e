"""Table online: large hyper-reduced scenes, one row per scene, basis, size and tolerance."""

from collections.abc import Iterable

import pandas as pd

from pdrom.core.store import read_table
from pdrom.tables.columns import COLUMNS, conform


def online(paths: Iterable[str]) -> pd.DataFrame:
    """Concatenation of the per-scene files, in order; empty if there is none."""
    parts = [read_table(path) for path in paths]
    if not parts:
        return pd.DataFrame(columns=COLUMNS["online"])
    return conform(pd.concat(parts, ignore_index=True), "online")
