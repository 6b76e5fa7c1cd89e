"""Whether a compared table holds: what differs, where, and by how much."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from study.tables.kit.declaration import Column, Table
from study.verification.compare import SAMPLES, Comparison, kept, names, names_row

# Columns of a row that say which one it is.
NAMED = 6
# So many cells of a column are far closer than the tolerance of one: nine of ten errors, half of
# less than `TEN` and of other quantities, from `LEAST` cells on. Closer means this distance, or
# that part of the tolerance which a column has of its own. Fewer cells are each closer than `LONE`,
# where the column has no tolerance of its own.
MOST, HALF, TEN, LEAST = 0.9, 0.5, 10, 3
CLOSE, OWN, LONE = 1e-5, 50, 0.01
# Of cells that rounding decides about, a tenth may have another outcome or another order of
# magnitude, and half may be off by more than a factor of two; and by what they are counted.
LOOSE = ((0.1, 1 - 1 / 10, ("scene", "noisy_axes", "method")), (0.5, 1 - 1 / 2, ("scene",)))
# Cells of a column with a share of its own that may differ in any case.
FEW = 3


@dataclass(frozen=True)
class Difference:
    """Something that is not as expected.

    where : row and column in words
    size : larger is worse; inf where there is no measure
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
    """Judgement of a table.

    differences : worst first
    compared : cells that were compared
    loose : cells that were compared by count, by the reason
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
    """Judgement on the table of a ``comparison``."""
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
    """A small shift of all cells is noticed although one may be off by more."""
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
    """Cells that rounding decides about: most have the same outcome, and the same magnitude.

    A number that is there on one side only is another outcome. Cells of one run count once.
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
    """Cell ``value`` as it stands in a message."""
    if pd.isna(value):
        return "nothing"
    return f"{value:.6g}" if isinstance(value, float) else str(value)[:60]


def _row_in_words(table: Table, frame: pd.DataFrame, row: int) -> str:
    """Name of a ``row`` of ``frame``, a ``table``: its words and sizes."""
    columns = [c.name for c in table.columns if names_row(c) or c.quantity == "value"]
    cells = [(name, frame[name].iloc[row]) for name in columns]
    named = [f"{name} {in_words(value)}" for name, value in cells if not pd.isna(value)]
    return ", ".join(named[:NAMED])
