"""A table against the expected one: which rows belong together, how far each cell is off."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from study.artifact.reads import ProjectFile
from study.tables.kit.declaration import Column, Quantity, Table
from study.verification.rows import RUN, Context, names, of_fitted_samples, of_wrong_runs, pairs

# Differences below it count for nothing: rounding errors of sums.
FLOOR = 1e-12


def distance(quantity: Quantity, expected: pd.Series, found: pd.Series) -> np.ndarray:
    """Distance of each pair of cells of ``expected`` and ``found``.

    The difference where ``quantity`` is a share, of other numbers that over the larger of the two;
    0 if the cells are equal, inf if only one has a value.
    """
    same = _same(expected, found)
    numbers = pd.api.types.is_numeric_dtype(expected) and pd.api.types.is_numeric_dtype(found)
    if not numbers or pd.api.types.is_bool_dtype(expected):
        return np.where(same, 0.0, np.inf)
    a, b = (column.to_numpy(dtype=float, na_value=np.nan) for column in (expected, found))
    with np.errstate(all="ignore"):
        apart = np.abs(a - b)
        if quantity != "share":
            apart = np.where(apart <= FLOOR, 0.0, apart / np.maximum(np.abs(a), np.abs(b)))
    return np.where(same, 0.0, np.where(np.isnan(apart), np.inf, apart))


def _same(a: pd.Series, b: pd.Series) -> np.ndarray:
    if a.dtype == b.dtype == np.dtype(float):
        x, y = a.to_numpy(), b.to_numpy()
        return (x == y) | (np.isnan(x) & np.isnan(y))
    left, right = a.astype(object), b.astype(object)
    equal = (left == right).fillna(False).to_numpy(dtype=bool)
    return equal | (a.isna().to_numpy() & b.isna().to_numpy())


# Not compared with a reference.
NOT_COMPARED: tuple[Quantity, ...] = ("timed", "skipped")
# How far a number of samples from a fit, and the numbers of a wrong run, may be off, relative.
FITTED, OF_WRONG_RUNS = 0.25, 0.3


@dataclass
class Comparison:
    """Rows of two tables side by side.

    e, f : rows of the expected and of the found table that belong together
    """

    table: Table
    expected: pd.DataFrame
    found: pd.DataFrame
    context: Context = field(default_factory=Context)

    def __post_init__(self) -> None:
        self.pairs = pairs(self.table, self.expected, self.found)
        self.e = self.expected.iloc[[i for i, _ in self.pairs]].reset_index(drop=True)
        self.f = self.found.iloc[[j for _, j in self.pairs]].reset_index(drop=True)
        self._loose: dict[str, dict[str, np.ndarray]] = {}

    def columns(self) -> Iterator[Column]:
        """Columns that are compared."""
        return (c for c in self.table.columns if c.quantity not in NOT_COMPARED)

    def loose(self, column: Column) -> dict[str, np.ndarray]:
        """Cells of a column that rounding decides about, by the reason."""
        if column.name not in self._loose:
            self._loose[column.name] = self.context.loose(self.table, column, self.e)
        return self._loose[column.name]

    def compared(self, column: Column) -> np.ndarray:
        """Cells of a column that are compared: those that do not depend on timing."""
        return np.array([column.name not in names for names in self._timed], dtype=bool)

    def beyond(self, column: Column, wider: float = 0.0) -> np.ndarray:
        """Cells that are off by more than the tolerance of their column, or than a wider one."""
        limit = np.maximum(self.limits(column), wider)
        return (self.apart(column) > limit) & self.compared(column)

    def limits(self, column: Column) -> np.ndarray:
        """Tolerance of each cell of a column."""
        limit = np.full(len(self.e), column.within)
        if column.quantity == "value" and column.kind == "integer":
            limit[of_fitted_samples(self.e)] = FITTED
        limit[self.wrong(column)] = max(column.within, OF_WRONG_RUNS)
        return limit

    def wrong(self, column: Column) -> np.ndarray:
        """Cells of ``column`` that say by their own value that a wrong run is wrong."""
        return of_wrong_runs(self.table, column, self.e)

    def apart(self, column: Column) -> np.ndarray:
        """Distance of each pair of cells of ``column``, in the measure of its quantity."""
        return distance(column.quantity, self.e[column.name], self.f[column.name])

    def unpaired(self) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Rows of the expected and of the found table without a partner.

        A table that lists only the runs that have an error (`Table.only_with_error`) lacks those
        that have none on the other side, where they have one on this side.
        """
        missing, new = (
            frame[~np.isin(np.arange(len(frame)), [pair[side] for pair in self.pairs])]
            for side, frame in enumerate((self.expected, self.found))
        )
        if not self.table.only_with_error:
            return missing, new
        expected, found = self.context.ended
        return _without(missing, found - expected), _without(new, expected - found)

    @cached_property
    def _timed(self) -> list[set[str]]:
        """Names of the timed columns of each row, where they differ from row to row."""
        if self.table.timed_cells is None:
            return [set()] * len(self.e)
        reads = self.table.reads.items()
        files = {name: Path(r.path) for name, r in reads if isinstance(r, ProjectFile)}
        return [set(names) for names in self.table.timed_cells(self.e, **files)]


def _without(rows: pd.DataFrame, runs: frozenset[tuple]) -> pd.DataFrame:
    return rows[[name not in runs for name in names(rows, RUN)]]
