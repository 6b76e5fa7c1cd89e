"""Table breakeven: reduced local steps over the full one, and where they stop paying."""

from collections.abc import Iterable

import pandas as pd

from pdrom.core.store import read_table
from pdrom.reduction.local.break_even import break_even
from pdrom.tables.columns import BREAKEVEN_CURVE, conform


def breakeven(paths: Iterable[str]) -> pd.DataFrame:
    """One row per size; ``breakeven_r`` belongs to a whole curve: scene, group, method,
    mesh (``factor`` on the vertices along a side of the scene's own) and number of threads.

    It is empty where the reduction still pays at the largest size, the numerical rank, and the
    smallest size tried where it never pays.
    """
    parts = [part for part in map(read_table, paths) if len(part)]
    table = pd.concat(parts, ignore_index=True)
    table["ratio"] = table.local_ms / table.full_ms
    sizes = [
        pd.Series(break_even(*curve.sort_values("r")[["r", "ratio"]].to_numpy().T), curve.index)
        for _, curve in table.groupby(BREAKEVEN_CURVE, sort=False)
    ]
    table["breakeven_r"] = pd.concat(sizes).astype("Float64").round().astype("Int64")
    return conform(table, "breakeven")
