"""Table local_share: what part of a full-order frame the local step takes (claim C1)."""

from collections.abc import Iterable

import pandas as pd

from pdrom.core.store import read_table
from pdrom.tables.columns import conform


def local_share(timings: Iterable[str]) -> pd.DataFrame:
    """One row per scene and implementation; the share is local over local, assembly and global.

    Compiled kernels project and scatter in one pass: their assembly time is part of the local step.
    """
    table = pd.concat([read_table(path) for path in timings], ignore_index=True)
    full = table[table.method.isna()].copy()
    full["local_share"] = (full.local_ms + full.assembly_ms) / (
        full.local_ms + full.assembly_ms + full.global_ms
    )
    order = {"interpreted": 0, "numpy": 1, "compiled": 2}
    scenes = {scene: i for i, scene in enumerate(table.scene.unique())}
    keys = full.scene.map(scenes) * 10 + full.implementation.map(order)
    return conform(full.iloc[keys.argsort(kind="stable")], "local_share")
