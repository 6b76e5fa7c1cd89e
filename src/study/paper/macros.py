r"""Numbers in the manuscript's text, and sentences that are left out if their numbers are missing.

The TeX source refers to a number by a key, which is the number's place in a table::

    \val{reduced_reruns|scene=bar_release|method=block-deim|r=20|motion=train|speedup}

A key consists of the table, any number of filters, the column, and optionally an aggregate of
the matching rows: ``max``, ``min``, ``median``, ``count`` or ``distinct`` (the number of different
values). A filter is column=value or column!=value. Each key that the source uses becomes one TeX
macro, so that no number is typed by hand.

A block ``\known{... \val{key} ...}`` is a sentence, a block ``\row{... & \val{key} \\}`` a row of a
table. A block is left out if the study's tables have no row for one of its keys.
"""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from pdrom.core.errors import PaperError
from study.artifact.text import escape

VAL = re.compile(r"\\val\{([^{}]*)\}")
_FILTER = re.compile(r"(.*?)(!?=)(.*)")
Filter = tuple[str, str, str]  # (column, "=" or "!=", value)
MISSING = "n/a"
HIDDEN = "hidden"
PICTURE = re.compile(r"\\(?:figureof|pictureof)\{(\w+)\}")
_COUNTS = ("count", "distinct")
# The text shows a count only if a row of the table has the names in these columns that its key has.
_LABELS = ("scene", "group", "method", "position_basis", "variant", "direction", "experiment")
AGGREGATES: dict[str, Callable[[pd.Series], Any]] = {
    "max": pd.Series.max,
    "min": pd.Series.min,
    "median": pd.Series.median,
    "count": len,
    "distinct": pd.Series.nunique,
}


def keys_of(source: str) -> list[str]:
    """Return the keys of ``\\val`` in a TeX source, in order of first use."""
    return list(dict.fromkeys(VAL.findall(source)))


def macros(source: str, tables: Mapping[str, pd.DataFrame]) -> str:
    r"""Return TeX macros for every ``\val`` key of ``source``, see `number_of`."""
    return _defined("val", {key: number_of(key, tables).text for key in keys_of(source)})


def _defined(kind: str, texts: Mapping[str, str]) -> str:
    made = [rf"\expandafter\def\csname {kind}@{k}\endcsname{{{text}}}" for k, text in texts.items()]
    return "\n".join(["% generated", r"\makeatletter", *made, r"\makeatother"]) + "\n"


class Number(NamedTuple):
    """A number in the manuscript's text, and the table cells from which it is computed.

    text : the number as TeX
    value : unrounded value, None if there is none
    rows : row numbers of these cells in ``table``, from 0
    take : name of the aggregate over these cells, None for a single cell
    """

    text: str
    value: str | float | None
    table: str
    rows: list[int]
    column: str
    take: str | None


def number_of(key: str, tables: Mapping[str, pd.DataFrame]) -> Number:
    """Return the number that ``key`` selects; its text is `MISSING` if there is no value.

    Raises PaperError for an unknown table or column, or several rows without an aggregate.
    """
    table, filters, column, aggregate = _parse(key, tables)
    rows = matching(tables[table], filters)
    cells = rows[column].dropna()
    if aggregate is None and len(rows) > 1:
        raise PaperError(f"\\val{{{key}}}: matches {len(rows)} rows of table '{table}'")
    counts = aggregate in _COUNTS
    value: Any = None
    text = MISSING
    if is_held(key, tables) if counts else len(cells):
        value = AGGREGATES[aggregate](cells) if aggregate else cells.iloc[0]
        text = str(value) if counts else format_number(value)
        if not isinstance(value, str):  # JSON has no infinite numbers: store them as text
            value = float(value) if np.isfinite(value) else str(float(value))
    held = [int(row) for row in np.flatnonzero(tables[table].index.isin(cells.index))]
    return Number(text, value, table, held, column, aggregate)


def is_held(key: str, tables: Mapping[str, pd.DataFrame]) -> bool:
    """Return whether ``tables`` have a row that ``key`` selects; the cell there may be empty.

    Columns that the attribute `HIDDEN` of a frame lists (unreliable times) count as missing.

    If ``key`` counts cells, only its filters on columns `_LABELS` are used, as 0 is a count, too.
    """
    table, filters, column, aggregate = _parse(key, tables)
    if aggregate in _COUNTS:
        filters = [entry for entry in filters if entry[0] in _LABELS]
    hidden = column in tables[table].attrs.get(HIDDEN, ())
    return not hidden and len(matching(tables[table], filters)) > 0


def _parse(
    key: str, tables: Mapping[str, pd.DataFrame]
) -> tuple[str, list[Filter], str, str | None]:
    """Table, filters, column, aggregate in the key of a number in TeX; PaperError if unknown."""
    name, *parts = key.split("|")
    if name not in tables:
        raise PaperError(f"\\val{{{key}}}: no table '{name}' (allowed: {', '.join(tables)})")
    aggregate = parts.pop() if parts and parts[-1] in AGGREGATES else None
    if not parts or "=" in parts[-1]:
        raise PaperError(f"\\val{{{key}}}: names no column of table '{name}'")
    *entries, column = parts
    filters: list[Filter] = []
    for entry in entries:
        parsed = _FILTER.fullmatch(entry)
        filters.append((parsed[1], parsed[2], parsed[3]) if parsed else (entry, "=", ""))
    for field in (*(field for field, _, _ in filters), column):
        if field not in tables[name]:
            allowed = ", ".join(tables[name].columns)
            raise PaperError(f"\\val{{{key}}}: no column '{field}' (allowed: {allowed})")
    return name, filters, column, aggregate


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


def format_number(value: Any) -> str:
    """Format a cell as TeX: text is escaped, numbers except integers get two significant digits."""
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
        return f"{number:.{max(0, 1 - power)}f}"
    return rf"\ensuremath{{{mantissa}\cdot 10^{{{power}}}}}"


_OPENING = re.compile(r"\\(?:known|row)\{")
_BRACE = re.compile(r"\\.|[{}]")  # a brace, or a backslash with the character that it escapes
SHOWN, DROPPED = "shown", "dropped"


class Sentence(NamedTuple):
    r"""Block ``\known`` or ``\row``: content, and its slice of the TeX source."""

    text: str
    start: int
    end: int


def sentences(source: str) -> list[Sentence]:
    r"""Return all ``\known`` and ``\row`` blocks of a TeX source, in order.

    Raises PaperError if a block is not closed or contains another block.
    """
    found: list[Sentence] = []
    for opening in _OPENING.finditer(source):
        if found and opening.start() < found[-1].end:
            raise PaperError(f"{source[found[-1].start :][:40]} ...: holds another one")
        end = closing(source, opening.end())
        found.append(Sentence(source[opening.end() : end], opening.start(), end + 1))
    return found


def decisions(
    source: str, tables: Mapping[str, pd.DataFrame], drawn: Collection[str] = ()
) -> list[str]:
    r"""Show each ``\known`` or ``\row`` block of which ``tables`` and ``drawn`` have everything."""
    return [
        SHOWN
        if {*PICTURE.findall(sentence.text)} <= {*drawn}
        and all(is_held(key, tables) for key in keys_of(sentence.text))
        else DROPPED
        for sentence in sentences(source)
    ]


def provenance(
    decided: Mapping[str, Sequence[str]], part: str | None, full_study: str, times: str = ""
) -> str:
    r"""TeX definitions of ``\ifpart``, ``\timesnote``, names of configurations; shown blocks.

    decided : name of a document (``\jobname`` in TeX) -> result of `decisions` for its source
    part, full_study : as in class `Facts`; ``\ifpart`` is false if ``part`` is None
    times : what the documents say about unreliable times
    """
    lines = [
        r"\newif\ifpart",
        r"\parttrue" if part is not None else r"\partfalse",
        rf"\newcommand{{\configuration}}{{\texttt{{{escape(part or full_study)}}}}}",
        rf"\newcommand{{\fullstudy}}{{\texttt{{{escape(full_study)}}}}}",
        rf"\newcommand{{\timesnote}}{{{times}}}",
        r"\makeatletter",
    ]
    for document, made in decided.items():
        for number, decision in enumerate(made, start=1):
            name = f"known@{document}@{number}"
            lines.append(rf"\expandafter\let\csname {name}\endcsname\known@{decision}")
    return "\n".join([*lines, r"\makeatother"]) + "\n"


def closing(source: str, start: int) -> int:
    """Position of the brace in ``source`` that closes a block whose content begins at ``start``."""
    depth = 1
    for brace in _BRACE.finditer(source, start):
        depth += {"{": 1, "}": -1}.get(brace[0], 0)
        if depth == 0:
            return brace.start()
    raise PaperError(f"{source[start - 1 : start + 40]} ...: is not closed")


def captions(texts: Mapping[str, str]) -> str:
    r"""Return TeX macros ``caption@NAME`` with the captions of all figures, given as TeX."""
    return _defined("caption", texts)
