"""Times of one study over those of another: medians with their intervals."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from pdrom.tables.kit.intervals import median_interval
from pdrom.verification.compare import Comparison

UNITS = ("s", "ms", "us", "ns")


@dataclass(frozen=True)
class Ratio:
    """A time of B over that of A: the median over scenes, and its 95 % interval.

    scenes : how many there are, each with the median of its rows; of a table without scenes, rows
    rows : how many pairs of times
    """

    table: str
    column: str
    scenes: int
    rows: int
    median: float
    low: float
    high: float


def ratios(comparisons: Mapping[str, Comparison]) -> list[Ratio]:
    """Ratios of every column of times that both have, that of all together first."""
    found = {
        (name, column.name): _quotients(comparison, column.name)
        for name, comparison in comparisons.items()
        for column in comparison.table.columns
        if column.timed and column.kind == "number" and column.unit in UNITS
    }
    named = [rows for rows in found.values() if "scene" in rows]
    whole = {("all tables", ""): pd.concat(named)} if named else {}
    return [_ratio(*key, rows) for key, rows in (whole | found).items() if len(rows)]


def _quotients(comparison: Comparison, column: str) -> pd.DataFrame:
    a, b = comparison.e[column].to_numpy(float), comparison.f[column].to_numpy(float)
    with np.errstate(all="ignore"):
        rows = comparison.e.filter(["scene"]).assign(ratio=b / a)
    return rows[np.isfinite(rows.ratio) & (rows.ratio > 0)]


def _ratio(table: str, column: str, rows: pd.DataFrame) -> Ratio:
    values: Iterable[float] = rows.ratio
    if "scene" in rows:
        values = rows.groupby("scene").ratio.median()
    values = np.asarray(values, float)
    return Ratio(table, column, len(values), len(rows), *median_interval(values))
