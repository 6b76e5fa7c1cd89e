"""Rows of a table and of the expected one that belong together."""

from collections.abc import Sequence

import pandas as pd

from study.tables.kit.declaration import Column, Table

Pairs = list[tuple[int, int]]


def names_row(column: Column) -> bool:
    """Whether a column says which row it is: a name, a parameter, a size."""
    return column.quantity == "exact" and not column.timed


def pairs(table: Table, expected: pd.DataFrame, found: pd.DataFrame) -> Pairs:
    """(row of ``expected``, row of ``found``) of all rows of ``table`` that belong together.

    Rows with the same names and numbers of samples belong together; of those that are left, rows
    with the same names, in their order: a number of samples may differ where a fit leaves it.
    """
    made: Pairs = []
    left = [list(range(len(expected))), list(range(len(found)))]
    named = [c.name for c in table.columns if names_row(c)]
    counts = [c.name for c in table.columns if c.quantity == "value" and c.kind == "integer"]
    for columns in ([*named, *counts], named):
        if not all(left):
            break
        more = _matched(_keys(expected, columns, left[0]), _keys(found, columns, left[1]))
        made += more
        taken = [{pair[side] for pair in more} for side in (0, 1)]
        left = [[row for row in rows if row not in taken[i]] for i, rows in enumerate(left)]
    return sorted(made)


def _keys(frame: pd.DataFrame, columns: Sequence[str], rows: list[int]) -> dict[int, tuple]:
    part = frame.iloc[rows]
    cells = [[_key(cell) for cell in part[name]] for name in columns]
    return dict(zip(rows, zip(*cells, strict=True), strict=True))


def _key(cell: object) -> object:
    """A cell without the digits that references do not have; one word for what is missing."""
    if cell is None or cell is pd.NA or cell != cell:
        return ""
    return f"{cell:.6g}" if isinstance(cell, float) else cell


def _matched(expected: dict[int, tuple], found: dict[int, tuple]) -> Pairs:
    waiting: dict[tuple, list[int]] = {}
    for row, key in found.items():
        waiting.setdefault(key, []).append(row)
    matched = []
    for row, key in expected.items():
        if waiting.get(key):
            matched.append((row, waiting[key].pop(0)))
    return matched
