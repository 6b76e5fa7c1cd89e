"""Whether a compared table holds: what differs, where, and by how much."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from pdrom.tables.declaration import Column, Table
from pdrom.verification.compare import SAME, Comparison
from pdrom.verification.rows import of_fitted_samples
from pdrom.verification.spread import AS_A_WHOLE, COMPARED, TEN, Spread, spreads
from pdrom.verification.tolerances import Tolerances

# Columns of a row that say which one it is.
NAMED = 6


@dataclass(frozen=True)
class Difference:
    """Something that is not as expected.

    where : row and column in words
    size : larger is worse; inf where there is no measure
    """

    where: str
    expected: str
    found: str
    size: float
    allowed: float

    def __str__(self) -> str:
        text = f"{self.where}: expected {self.expected}, found {self.found}"
        if np.isfinite(self.size):
            text += f" (off by {self.size:.2g}, allowed {self.allowed:.2g})"
        return text


@dataclass(frozen=True)
class Judgement:
    """What came of the comparison of a table, or of what is drawn or said from tables.

    differences : worst first
    compared : cells that were compared
    left_out : cells that were not, by the reason
    """

    name: str
    differences: tuple[Difference, ...]
    compared: int
    left_out: Counter[str]


def judge(comparison: Comparison, tolerances: Tolerances, anew: float) -> Judgement:
    """Judgement on a table.

    Parameters
    ----------
    anew : share of the rows whose samples may have been chosen anew
    """
    found = [
        *_rows(comparison),
        *_equal(comparison),
        *_counts(comparison),
        *_within(comparison, tolerances),
        *_class(comparison),
        *_anew(comparison, anew),
    ]
    found.sort(key=lambda difference: -difference.size)
    left_out: Counter[str] = Counter()
    compared = 0
    for column in comparison.table.columns:
        seen = np.zeros(len(comparison.e), dtype=bool)
        for reason, cells in comparison.reasons(column).items():
            left_out[reason] += int((cells & ~seen).sum())
            seen |= cells
        compared += int((~seen).sum())
    return Judgement(comparison.table.name, tuple(found), compared, +left_out)


def _rows(comparison: Comparison) -> Iterator[Difference]:
    missing, new = comparison.unpaired()
    for frame, expected, found in ((missing, "a row", "none"), (new, "none", "a row")):
        for i in range(len(frame)):
            yield Difference(row_in_words(comparison.table, frame, i), expected, found, np.inf, 0)


def _equal(comparison: Comparison) -> Iterator[Difference]:
    for column in comparison.columns("exact", "verdict"):
        apart = (comparison.distances[column.name] > 0) & ~comparison.free(column)
        for row in np.flatnonzero(apart):
            yield _difference(comparison, column, int(row), np.inf, 0.0)


def _counts(comparison: Comparison) -> Iterator[Difference]:
    """Counts are equal but where samples were chosen anew, or are what a fit leaves."""
    loose = comparison.anew | of_fitted_samples(comparison.e)
    for column in comparison.columns("count"):
        apart = comparison.distances[column.name]
        fixed = (apart > SAME) & ~comparison.free(column) & ~loose
        for row in np.flatnonzero(fixed):
            yield _difference(comparison, column, int(row), float(apart[row]), 0.0)


def _within(comparison: Comparison, tolerances: Tolerances) -> Iterator[Difference]:
    for spread in spreads(comparison):
        limit = tolerances[spread.quantity, spread.rows]
        beyond = spread.distances > limit.every
        column = _column(comparison, spread)
        for place in np.flatnonzero(beyond):
            yield _difference(
                comparison,
                column,
                int(spread.cells[place]),
                float(spread.distances[place]),
                limit.every,
                whole=spread.quantity in AS_A_WHOLE,
            )
        if spread.nine_of_ten > limit.nine and not beyond.any() and len(spread.distances) >= TEN:
            share = float(np.mean(spread.distances > limit.nine))
            yield Difference(
                f"{column.name}, {spread.rows}",
                f"nine of ten cells within {limit.nine:.2g}",
                f"{1 - share:.0%} of them",
                spread.nine_of_ten,
                limit.nine,
            )


def _column(comparison: Comparison, spread: Spread) -> Column:
    return next(c for c in comparison.columns(*COMPARED) if c.name == spread.column)


def _class(comparison: Comparison) -> Iterator[Difference]:
    words = {True: "a failed run", False: "a run that does not fail"}
    for row in np.flatnonzero(comparison.class_changed):
        expected, found = (words[bool(side[row])] for side in comparison.failed)
        where = row_in_words(comparison.table, comparison.e, int(row))
        yield Difference(where, expected, found, np.inf, 0.0)


def _anew(comparison: Comparison, allowed: float) -> Iterator[Difference]:
    judged = ~comparison.chaotic
    share = float(np.mean(comparison.anew[judged])) if judged.any() else 0.0
    if comparison.anew[judged].sum() > 1 and share > allowed:
        yield Difference(
            "rows whose samples were chosen anew",
            f"at most {allowed:.0%}",
            f"{share:.0%}",
            share,
            allowed,
        )


def _difference(
    comparison: Comparison,
    column: Column,
    row: int,
    size: float,
    allowed: float,
    whole: bool = False,
) -> Difference:
    place = row_in_words(comparison.table, comparison.e, row)
    where = f"{column.name} as a whole, worst {place}" if whole else f"{place} {column.name}"
    expected, found = (
        in_words(frame[column.name].iloc[row]) for frame in (comparison.e, comparison.f)
    )
    return Difference(where.strip(), expected, found, size, allowed)


def in_words(value: object) -> str:
    """A cell as it stands in a message."""
    if pd.isna(value):
        return "nothing"
    return f"{value:.6g}" if isinstance(value, float) else str(value)[:60]


def row_in_words(table: Table, frame: pd.DataFrame, row: int) -> str:
    """What names a row: its words and sizes."""
    names = [c.name for c in table.columns if c.quantity in ("exact", "count", "value")]
    cells = [(name, frame[name].iloc[row]) for name in names]
    named = [f"{name} {in_words(value)}" for name, value in cells if not pd.isna(value)]
    return ", ".join(named[:NAMED])
