"""Table subspace_ablation: variants of block DEIM in position subspaces, all scenes."""

from collections.abc import Iterable

import pandas as pd

from pdrom.core.store import read_table
from pdrom.tables.columns import COLUMNS, conform


def subspace_ablation(paths: Iterable[str]) -> pd.DataFrame:
    """Concatenation of the per-scene files, in order; empty if there is none."""
    parts = [read_table(path) for path in paths]
    if not parts:
        return pd.DataFrame(columns=COLUMNS["subspace_ablation"])
    table = pd.concat(parts, ignore_index=True)
    table["elements_sampled"] = table["elements_sampled"].astype("Int64")
    table["finite"] = table["finite"].astype("boolean")
    return conform(table, "subspace_ablation")
