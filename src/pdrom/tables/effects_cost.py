"""Tables effects_cost and effects_left_out: what effects cost, and what leaving them out saves."""

from collections.abc import Iterable

import pandas as pd

from pdrom.core.store import read_table
from pdrom.tables.columns import COLUMNS, conform


def effects_cost(paths: Iterable[str]) -> pd.DataFrame:
    """The scenes' tables one after the other; the shares of a scene add up to one."""
    return _joined(paths, "effects_cost")


def effects_left_out(paths: Iterable[str]) -> pd.DataFrame:
    """Scenes with several groups, as they are and without some of their effects."""
    return _joined(paths, "effects_left_out")


def _joined(paths: Iterable[str], name: str) -> pd.DataFrame:
    parts = [part for part in map(read_table, paths) if len(part)]
    if not parts:
        return pd.DataFrame(columns=COLUMNS[name])
    return conform(pd.concat(parts, ignore_index=True), name)
