"""Judgement of a compared table: all differences, with their places and sizes."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from study.tables.kit.declaration import Column, Table
from study.verification.compare import SAMPLES, Comparison, kept, names, names_row

# Largest number of cells that describe a row in a message.
NAMED = 6
# A column of at least `LEAST` numbers must also agree far more closely than the tolerance of one
# cell: nine of ten cells if it has at least `TEN` errors, else half of its cells, are closer than
# `CLOSE`, or than 1/`OWN` of the column's own tolerance. In a shorter column without own tolerance
# all cells are closer than `LONE`.
MOST, HALF, TEN, LEAST = 0.9, 0.5, 10, 3
CLOSE, OWN, LONE = 1e-5, 50, 0.01
# Limits for cells that rounding decides: (share of runs that may be off, distance that counts as
# off, columns by which runs are grouped). A tenth may be off by a factor 10, half by a factor 2.
LOOSE = ((0.1, 1 - 1 / 10, ("scene", "noisy_axes", "method")), (0.5, 1 - 1 / 2, ("scene",)))
# Least number of differing cells that a text or flag column with a tolerance may have.
FEW = 3


@dataclass(frozen=True)
class Difference:
    """A difference between the expected and the found table.

    where : row and column in words
    size : distance of the cells, larger is worse; inf for a difference without a measure
    """

    where: str
    expected: str
    found: str
    size: float = np.inf
    allowed: float = 0.0

    def __str__(self) -> str:
        text = f"{self.where}: expected {self.expected}, found {self.found}"
        if np.isfinite(self.size):
            text += f" (off by {self.size:.2g}, allowed {self.allowed:.2g})"
        return text


@dataclass(frozen=True)
class Judgement:
    """Outcome of the comparison of a table.

    differences : all differences, largest first
    compared : number of compared cells
    loose : number of cells that rounding decides, by the reason; these are compared by counts
    """

    differences: tuple[Difference, ...]
    compared: int
    loose: Counter[str]

    def __str__(self) -> str:
        if self.compared == 0:
            return "it has no rows"
        reasons = ", ".join(f"{reason} {count}" for reason, count in self.loose.most_common())
        return f"{self.compared} cells" + (f"; by count: {reasons}" if reasons else "")


def judge(comparison: Comparison) -> Judgement:
    """Return the judgement of a ``comparison``: differences of its rows and of all columns."""
    found = [*_rows(comparison)]
    compared, loose = 0, Counter[str]()
    for column in kept(comparison.table).values():
        found += _cells(comparison, column)
        compared += int(comparison.compared(column).sum())
        loose.update({why: int(c.sum()) for why, c in comparison.loose(column).items()})
    found.sort(key=lambda difference: -difference.size)
    return Judgement(tuple(found), compared, +loose)


def _rows(comparison: Comparison) -> Iterator[Difference]:
    missing, new = comparison.unpaired()
    for frame, expected, found in ((missing, "a row", "none"), (new, "none", "a row")):
        for i in range(len(frame)):
            yield Difference(_row_in_words(comparison.table, frame, i), expected, found)
    moved = np.flatnonzero(np.diff([row for _, row in comparison.pairs]) < 0)
    if len(moved):
        place = _row_in_words(comparison.table, comparison.e, int(moved[0]) + 1)
        yield Difference(f"order of the rows, {place}", "further down", "further up")


def _cells(comparison: Comparison, column: Column) -> Iterator[Difference]:
    beyond, firm = comparison.beyond(column), comparison.firm(column)
    if column.kind in ("text", "flag") and column.tolerance:
        allowed = max(FEW, column.within * len(beyond))
        if beyond.sum() > allowed:
            place = _row_in_words(comparison.table, comparison.e, int(np.argmax(beyond)))
            words = f"at most {int(allowed)} other cells", f"{beyond.sum()}"
            yield Difference(f"{column.name}, as of {place}", *words)
        return
    apart, limits = comparison.apart(column), comparison.limits(column)
    for row in map(int, np.flatnonzero(beyond & firm)):
        place = f"{_row_in_words(comparison.table, comparison.e, row)} {column.name}".strip()
        expected, found = (
            in_words(frame[column.name].iloc[row]) for frame in (comparison.e, comparison.f)
        )
        yield Difference(place, expected, found, float(apart[row]), float(limits[row]))
    if not (beyond & firm).any() and column.kind in ("number", "integer"):
        yield from _shifted(comparison, column, firm & ~comparison.wrong(column))
    yield from _loose(comparison, column, ~firm)


def _shifted(comparison: Comparison, column: Column, firm: np.ndarray) -> Iterator[Difference]:
    """Yield a difference if most cells of a column are off by little, as by a small shift."""
    there = (comparison.e[column.name].fillna(0) != 0).to_numpy(dtype=bool)
    cells = firm & there & comparison.compared(column)
    own, count = column.tolerance, cells.sum()
    if not count or (own is not None and count < LEAST):
        return
    strict = column.quantity == "error" and own is None and count >= TEN
    share, close = MOST if strict else HALF, CLOSE if own is None else own / OWN
    if count < LEAST:
        share, close = 1.0, LONE
    size = float(np.quantile(comparison.apart(column)[cells], share))
    if size > close:
        words = f"a share of {share:g} of the cells within {close:g}", f"within {size:.2g}"
        yield Difference(column.name, *words, size, close)


def _loose(comparison: Comparison, column: Column, cells: np.ndarray) -> Iterator[Difference]:
    """Yield differences where too many runs have cells off, among cells that rounding decides.

    A value that is missing in one table counts as off. Cells of the same run count once.
    """
    rows = comparison.e[cells]
    run = [*SAMPLES, *({"seed"} & set(rows.columns))]
    for share, wider, by in LOOSE:
        other = comparison.beyond(column, wider if column.kind == "number" else 0.0)[cells]
        if not other.any():
            continue
        runs = names(rows, run) if set(run) <= set(rows.columns) else range(len(rows))
        counted = pd.DataFrame({"run": runs, "other": other}, rows.index)
        named = [rows[name] for name in by if name in rows and "scene" in rows]
        all_rows = [pd.Series("all rows", rows.index)]
        for group, part in counted.groupby(named or all_rows, dropna=False):
            of_runs = part.groupby("run").other.any()
            allowed = max(1.0, share * len(of_runs))
            if of_runs.sum() > allowed:
                place = f"{column.name} of {', '.join(map(str, group))}"
                words = f"at most {int(allowed)} of {len(of_runs)} other", f"{of_runs.sum()}"
                yield Difference(place, *words)


def in_words(value: object) -> str:
    """Cell ``value`` as text for a message."""
    if pd.isna(value):
        return "nothing"
    return f"{value:.6g}" if isinstance(value, float) else str(value)[:60]


def _row_in_words(table: Table, frame: pd.DataFrame, row: int) -> str:
    """Text that identifies a ``row`` of ``frame``: its names, sizes and values, at most `NAMED`."""
    columns = [c.name for c in table.columns if names_row(c) or c.quantity == "value"]
    cells = [(name, frame[name].iloc[row]) for name in columns]
    named = [f"{name} {in_words(value)}" for name, value in cells if not pd.isna(value)]
    return ", ".join(named[:NAMED])
