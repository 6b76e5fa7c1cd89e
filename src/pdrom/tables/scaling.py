"""Tables scaling and scaling_fit: time and memory against the number of vertices."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from pdrom.experiments.names import FOM
from pdrom.tables.columns import COLUMNS, conform

QUANTITIES = ("ms_per_iteration", "local_ms", "global_ms", "factorisation_ms", "memory_mb")


def scaling(paths: Iterable[str]) -> pd.DataFrame:
    """All scenes, one row per mesh size and method (``fom``, a reduced local step, ``ecsw``).

    The speed-ups, of an iteration and of its local step, are over the full-order run on one thread.
    """
    parts = [_with_speedups(read_table(path)) for path in paths]
    if not parts:
        return pd.DataFrame(columns=list(COLUMNS["scaling"]))
    table = pd.concat(parts, ignore_index=True)
    counts = dict.fromkeys(("r", "k", "elements_sampled"), "Int64")
    return conform(table.astype(counts), "scaling")


def _with_speedups(part: pd.DataFrame) -> pd.DataFrame:
    (own,) = part[(part.method == FOM) & (part.threads == 1)].itertuples()
    return part.assign(
        speedup=own.ms_per_iteration / part.ms_per_iteration,
        local_speedup=own.local_ms / part.local_ms,
    )


def scaling_fit(table: pd.DataFrame) -> pd.DataFrame:
    """Exponents of power laws in the number of vertices, by least squares on the logarithms.

    A quantity with fewer than two sizes has no row.
    """
    rows = []
    for labels, part in table.groupby(["scene", "method", "threads"], sort=False):
        for quantity in QUANTITIES:
            points = part[["vertices", quantity]].dropna()
            points = points[points[quantity] > 0.0].astype(float)
            if points.vertices.nunique() < 2:
                continue
            exponent, _ = np.polyfit(np.log(points.vertices), np.log(points[quantity]), 1)
            rows.append([*labels, quantity, exponent, len(points)])
    return pd.DataFrame(rows, columns=list(COLUMNS["scaling_fit"]))
