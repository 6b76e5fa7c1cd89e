"""Which row of a table belongs to which row of the expected one."""

from collections.abc import Sequence

import pandas as pd

from pdrom.tables.declaration import Table

Pairs = list[tuple[int, int]]
_NAMES = ("exact",)
_NAMES_AND_COUNTS = ("exact", "count")


def pairs(table: Table, expected: pd.DataFrame, found: pd.DataFrame) -> Pairs:
    """(row of ``expected``, row of ``found``) of all rows that belong together.

    Rows with the same names, parameters and counts belong together; of those that are left, rows
    with the same names and parameters, in their order: a count may differ where rounding picks
    samples.
    """
    made: Pairs = []
    left = [list(range(len(expected))), list(range(len(found)))]
    for quantities in (_NAMES_AND_COUNTS, _NAMES):
        if not all(left):
            break
        columns = [c.name for c in table.columns if c.quantity in quantities]
        more = _matched(_keys(expected, columns, left[0]), _keys(found, columns, left[1]))
        made += more
        taken = [{pair[side] for pair in more} for side in (0, 1)]
        left = [[row for row in rows if row not in taken[i]] for i, rows in enumerate(left)]
    return sorted(made)


def _keys(frame: pd.DataFrame, columns: Sequence[str], rows: list[int]) -> dict[int, tuple]:
    part = frame.iloc[rows]
    cells = [["" if _is_missing(cell) else cell for cell in part[name]] for name in columns]
    return dict(zip(rows, zip(*cells, strict=True), strict=True))


def _is_missing(cell: object) -> bool:
    return cell is None or cell is pd.NA or cell != cell


def _matched(expected: dict[int, tuple], found: dict[int, tuple]) -> Pairs:
    waiting: dict[tuple, list[int]] = {}
    for row, key in found.items():
        waiting.setdefault(key, []).append(row)
    matched = []
    for row, key in expected.items():
        if waiting.get(key):
            matched.append((row, waiting[key].pop(0)))
    return matched
