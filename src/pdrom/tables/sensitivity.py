"""Table sensitivity: how far runs drift apart that should be the same."""

from collections.abc import Iterable

import pandas as pd

from pdrom.core.store import read_table
from pdrom.tables.columns import conform


def sensitivity(paths: Iterable[str]) -> pd.DataFrame:
    """Largest difference over the seeds, per scene, perturbation and frame."""
    every = pd.concat([read_table(path) for path in paths], ignore_index=True)
    keys = ["scene", "perturbation", "frame"]
    table = every.groupby(keys, sort=False, as_index=False)["relative_difference"].max()
    return conform(table, "sensitivity")
