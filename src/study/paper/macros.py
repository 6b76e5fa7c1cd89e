r"""Numbers of the manuscript.

The source names a number by where it stands in a table::

    \val{reduced_reruns|scene=bar_release|method=block-deim|r=20|motion=train|speedup}

(table, any number of filters, the column; optionally ``max``, ``min``, ``median``, ``count`` or
``distinct``, the number of different values, of the rows that match). A filter is column=value
or column!=value. The keys are found in the source, resolved here, and written as
one TeX macro each. No number is typed, and none is generated that the text does not use.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.errors import PaperError
from pdrom.view.text import escape

_KEY = re.compile(r"\\val\{([^{}]*)\}")
_FILTER = re.compile(r"(.*?)(!?=)(.*)")
Filter = tuple[str, str, str]  # column, sign, value
MISSING = "n/a"
_COUNTS = ("count", "distinct")
# Columns that say what was run; the others say what came out.
_LABELS = ("scene", "group", "method", "position_basis", "variant", "direction", "experiment")
AGGREGATES: dict[str, Callable[[pd.Series], Any]] = {
    "max": lambda column: column.max(),
    "min": lambda column: column.min(),
    "median": lambda column: column.median(),
    "count": lambda column: len(column),
    "distinct": lambda column: column.nunique(),
}


def keys_of(source: str) -> list[str]:
    """Keys that a TeX source uses, in order of first use."""
    return list(dict.fromkeys(_KEY.findall(source)))


def macros(source: str, tables: Mapping[str, pd.DataFrame]) -> str:
    r"""TeX definitions for every \val key of ``source``, with numbers of ``tables``.

    Raises
    ------
    PaperError
        An unknown table or column, or a key that matches several rows without an aggregate.
    """
    lines = [
        "% generated from results/tables",
        r"\makeatletter",
        r"\newcommand{\val}[1]{\@ifundefined{val@#1}{\errmessage{no value for #1}}"
        r"{\csname val@#1\endcsname}}",
    ]
    for key in keys_of(source):
        text = number_of(key, tables).text
        lines.append(rf"\expandafter\def\csname val@{key}\endcsname{{{text}}}")
    lines.append(r"\makeatother")
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class Number:
    """A number of the text, and where it stands.

    text : as TeX
    value : before it was rounded, None where there is none
    rows : those of ``table`` that it is taken of, counted from 0
    take : the aggregate, None for a single cell
    """

    text: str
    value: str | float | None
    table: str
    rows: list[int]
    column: str
    take: str | None


def number_of(key: str, tables: Mapping[str, pd.DataFrame]) -> Number:
    """Number of one ``key`` of ``tables``; its text is `MISSING` where there is none.

    Raises
    ------
    PaperError
        An unknown table or column, or several rows without an aggregate.
    """
    parsed = _parse(key, tables)
    rows = matching(tables[parsed.table], parsed.filters)
    cells = rows[parsed.column].dropna()
    if parsed.aggregate is None and len(rows) > 1:
        raise PaperError(f"\\val{{{key}}}: matches {len(rows)} rows of table '{parsed.table}'")
    counts = parsed.aggregate in _COUNTS
    if not (is_held(key, tables) if counts else len(cells)):
        text, value = MISSING, None
    else:
        take = AGGREGATES[parsed.aggregate] if parsed.aggregate else lambda column: column.iloc[0]
        value = take(cells)
        text = str(value) if counts else format_number(value)
        value = value if isinstance(value, str) else float(value)
        value = value if isinstance(value, str) or np.isfinite(value) else str(value)  # JSON
    held = [int(row) for row in np.flatnonzero(tables[parsed.table].index.isin(cells.index))]
    return Number(text, value, parsed.table, held, parsed.column, parsed.aggregate)


def is_held(key: str, tables: Mapping[str, pd.DataFrame]) -> bool:
    """Whether ``tables`` of a configuration hold what ``key`` asks for, be its cell empty or not.

    A count of none is a number where there are runs to count, whatever became of them.
    """
    parsed = _parse(key, tables)
    filters = parsed.filters
    if parsed.aggregate in _COUNTS:
        filters = [entry for entry in filters if entry[0] in _LABELS]
    return len(matching(tables[parsed.table], filters)) > 0


@dataclass(frozen=True)
class _Key:
    """A key in its parts."""

    table: str
    filters: list[Filter]
    column: str
    aggregate: str | None


def _parse(key: str, tables: Mapping[str, pd.DataFrame]) -> _Key:
    name, *parts = key.split("|")
    if name not in tables:
        raise PaperError(f"\\val{{{key}}}: no table '{name}' (allowed: {', '.join(tables)})")
    aggregate = parts.pop() if parts and parts[-1] in AGGREGATES else None
    if not parts or "=" in parts[-1]:
        raise PaperError(f"\\val{{{key}}}: names no column of table '{name}'")
    *filters, column = parts
    found = [_filter(entry) for entry in filters]
    for field in (*(field for field, _, _ in found), column):
        _require(field, tables[name], key)
    return _Key(name, found, column, aggregate)


def _filter(entry: str) -> Filter:
    parts = _FILTER.fullmatch(entry)
    return (parts[1], parts[2], parts[3]) if parts else (entry, "=", "")


def matching(rows: pd.DataFrame, filters: Sequence[Filter]) -> pd.DataFrame:
    """Rows of ``rows`` whose cells agree with every filter."""
    for field, sign, value in filters:
        matches = rows[field].map(lambda cell, value=value: _same(cell, value))
        rows = rows[matches.astype(bool) != (sign == "!=")]
    return rows


def _require(field: str, rows: pd.DataFrame, key: str) -> None:
    if field not in rows.columns:
        raise PaperError(
            f"\\val{{{key}}}: no column '{field}' (allowed: {', '.join(rows.columns)})"
        )


def _same(cell: Any, value: str) -> bool:
    if isinstance(cell, str):
        return cell == value
    try:
        return float(cell) == float(value)
    except (TypeError, ValueError):
        return str(cell) == value


def format_number(value: Any) -> str:
    """Cell ``value`` as TeX: text escaped, integers plain, others with two significant digits."""
    if isinstance(value, str):
        return escape(value)
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    number = float(value)
    if number != number:
        return MISSING
    if number in (float("inf"), float("-inf")):
        return r"\ensuremath{\infty}" if number > 0.0 else r"\ensuremath{-\infty}"
    if number == int(number) and abs(number) < 1e6:
        return str(int(number))
    mantissa, exponent = f"{number:.1e}".split("e")
    power = int(exponent)
    if -3 < power < 4:
        digits = max(0, 1 - power)
        return f"{number:.{digits}f}"
    return rf"\ensuremath{{{mantissa}\cdot 10^{{{power}}}}}"
