r"""Numbers of the manuscript's text: each has a name, and an entry in ``paper/numbers.yaml``.

The text prints a number by its name, as in ``\n{barSpeedup}``. The entry names the table cells from
which it is computed, and the condition that the sentence around it needs. Thus no number is typed,
and the build fails if a sentence no longer fits its number.
"""

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.errors import PaperError, choices
from pdrom.core.yamlfile import ConfigModel, read_yaml, validate
from study.artifact.text import escape

NUMBERS_FILE = "numbers.yaml"
NAMED = re.compile(r"\\n\{([^{}]*)\}")
MISSING = "n/a"
HIDDEN = "hidden"
Filter = tuple[str, str, str]  # (column, "=" or "!=", value)
_COUNTS = ("count", "distinct")
# The text shows a count only if a row of the table has the requested names in these columns.
_LABELS = ("scene", "group", "method", "position_basis", "variant", "direction", "experiment")
AGGREGATES: dict[str, Callable[[pd.Series], Any]] = {
    "max": pd.Series.max, "min": pd.Series.min, "median": pd.Series.median, "count": len,
    "distinct": pd.Series.nunique,
}  # fmt: skip
_SIGNS = {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}
_EXPECTATION = r"^(>=|<=|>|<) (\S+)$"
_Value = str | int | float | bool


class Entry(ConfigModel):
    """Source of a number of the text.

    table, column : a table of the study, and its column
    rows : column -> value, or values, that selects rows; "!=x" selects rows with other values
    take : number computed from several cells: the largest, smallest or median one, the number of
        cells, or the number of distinct values
    digits, percent : significant digits; whether the number is multiplied by 100
    expect : condition that the text needs, such as ">= 5"; the build of the full study checks it
    note : for authors
    """

    table: str
    column: str
    rows: dict[str, _Value | tuple[_Value, ...]] = Field(default_factory=dict)
    take: Literal["max", "min", "median", "count", "distinct"] | None = None
    digits: Annotated[int, Field(ge=1, le=6)] = 2
    percent: bool = False
    expect: Annotated[str, Field(pattern=_EXPECTATION)] | None = None
    note: str = ""

    @property
    def filters(self) -> list[Filter]:
        """Conditions on rows: (column, "=" or "!=", value)."""
        found = []
        for field, asked in self.rows.items():
            for value in map(str, asked if isinstance(asked, tuple) else (asked,)):
                sign = "!=" if value.startswith("!=") else "="
                found.append((field, sign, value.removeprefix("!=")))
        return found

    @property
    def key(self) -> str:
        """Place in the tables, as the article's pages parse it: table|column=value|column."""
        parts = [f"{field}{sign}{value}" for field, sign, value in self.filters]
        return "|".join([self.table, *parts, self.column, *([self.take] if self.take else [])])

    def met(self, value: Any) -> bool:
        """Return whether ``value`` satisfies the expectation of the text."""
        found = re.fullmatch(_EXPECTATION, self.expect or "")
        return found is None or bool(_SIGNS[found[1]](float(value), float(found[2])))


Entries = Mapping[str, Entry]


def entries(folder: Path) -> dict[str, Entry]:
    """Read the entries of all numbers of the manuscript in ``folder``; errors name the entry."""
    for place in (folder, folder.parent):
        if (path := place / NUMBERS_FILE).is_file():
            read = read_yaml(path)
            return {name: validate(Entry, own, f"{path}: {name}") for name, own in read.items()}
    raise PaperError(f"{folder}: no file {NUMBERS_FILE}, which every manuscript needs")


def names_of(source: str) -> list[str]:
    """Return the names of the numbers that a TeX source prints, in order of first use."""
    return list(dict.fromkeys(NAMED.findall(source)))


class Number(NamedTuple):
    """A number of the text as TeX, its unrounded value, and the cells from which it is computed.

    ``rows`` of ``table`` are counted from 0; ``take`` and ``key`` are those of the `Entry`.
    """

    text: str
    value: str | float | None
    table: str
    rows: list[int]
    column: str
    take: str | None
    key: str


def number_of(name: str, known: Entries, tables: Mapping[str, pd.DataFrame]) -> Number:
    """Compute the number ``name``; its text is `MISSING` if there is no value.

    Raises PaperError for an unknown name, table or column, or several rows without ``take``.
    """
    entry, rows = _selected(name, known, tables)
    cells = rows[entry.column].dropna()
    if entry.take is None and len(rows) > 1:
        raise PaperError(f"\\n{{{name}}}: {len(rows)} rows of '{entry.table}' match; add `take`")
    value: Any = None
    text, counts = MISSING, entry.take in _COUNTS
    if is_held(name, known, tables) if counts else len(cells):
        value = AGGREGATES[entry.take](cells) if entry.take else cells.iloc[0]
        shown = 100.0 * value if entry.percent else value
        text = str(value) if counts else format_number(shown, entry.digits)
        if not isinstance(value, str):  # JSON has no infinite numbers: store them as text
            value = float(value) if np.isfinite(value) else str(float(value))
    held = [int(row) for row in np.flatnonzero(tables[entry.table].index.isin(cells.index))]
    return Number(text, value, entry.table, held, entry.column, entry.take, entry.key)


def is_held(name: str, known: Entries, tables: Mapping[str, pd.DataFrame]) -> bool:
    """Return whether ``tables`` have a row for the number ``name``; the cell there may be empty.

    Columns that the attribute `HIDDEN` of a frame lists (unreliable times) count as missing.
    If cells are counted, only conditions on columns `_LABELS` are used, since 0 is a valid count.

    """
    entry, rows = _selected(name, known, tables)
    if entry.take in _COUNTS:
        labels = [each for each in entry.filters if each[0] in _LABELS]
        rows = matching(tables[entry.table], labels)
    return entry.column not in tables[entry.table].attrs.get(HIDDEN, ()) and len(rows) > 0


def _selected(
    name: str, known: Entries, tables: Mapping[str, pd.DataFrame]
) -> tuple[Entry, pd.DataFrame]:
    """Return entry ``name`` and its rows; PaperError if entry, table or column is unknown."""
    if name not in known:
        near = choices(name, get_close_matches(name, known))
        raise PaperError(f"\\n{{{name}}}: no entry in {NUMBERS_FILE}{near}")
    entry = known[name]
    if entry.table not in tables:
        fault = f"no table '{entry.table}'{choices(entry.table, tables)}"
        raise PaperError(f"{NUMBERS_FILE}: {name}: {fault}")
    table = tables[entry.table]
    for field in (*entry.rows, entry.column):
        if field not in table:
            fault = f"table '{entry.table}' has no column '{field}'{choices(field, table.columns)}"
            raise PaperError(f"{NUMBERS_FILE}: {name}: {fault}")
    return entry, matching(table, entry.filters)


def unexpected(known: Entries, tables: Mapping[str, pd.DataFrame]) -> dict[str, str]:
    """Map names of numbers that violate their expectation to their value and expectation."""
    faults = {}
    for name, entry in known.items():
        if entry.expect and is_held(name, known, tables):
            number = number_of(name, known, tables)
            if number.value is None or not entry.met(number.value):
                faults[name] = f"{number.value}, expected {entry.expect}"
    return faults


def matching(rows: pd.DataFrame, filters: Sequence[Filter]) -> pd.DataFrame:
    """Return the rows of the table ``rows`` that satisfy every filter."""
    for field, sign, value in filters:
        matches = rows[field].map(lambda cell, value=value: _same(cell, value))
        rows = rows[matches.astype(bool) != (sign == "!=")]
    return rows


def _same(cell: Any, value: str) -> bool:
    if isinstance(cell, str):
        return cell == value
    try:
        return float(cell) == float(value)
    except (TypeError, ValueError):
        return str(cell) == value


def format_number(value: Any, digits: int = 2) -> str:
    """Format a cell as TeX: escape text, round numbers except integers to ``digits`` digits."""
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
    mantissa, exponent = f"{number:.{digits - 1}e}".split("e")
    power = int(exponent)
    if -3 < power < 4:
        return f"{number:.{max(0, digits - 1 - power)}f}"
    return rf"\ensuremath{{{mantissa}\cdot 10^{{{power}}}}}"
