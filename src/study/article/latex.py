r"""Convert the manuscript's source to LaTeX that pandoc can read, with numbers as links.

Commands that TeX would evaluate are replaced by their results: ``\n``, ``\known``, ``\ifpart`` and
captions of figures. A number becomes a link to ``origin:KEY``, where KEY names a table and its rows
in hexadecimal digits.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from study.artifact.text import escape
from study.artifact.words import code
from study.paper.build import Facts
from study.paper.macros import SHOWN, closing, sentences
from study.paper.numbers import NAMED, matching
from study.paper.source import COMMENT, PLACED
from study.paper.textables import Rows, tabular

ORIGIN = "origin:"
_MATH = re.compile(r"(?<!\\)\$((?:[^$\\]|\\.)*)\$", re.DOTALL)
_ENSURED = re.compile(r"\\ensuremath\{((?:[^{}]|\{[^{}]*\})*)\}")
_PART = re.compile(r"(?s)\\ifpart(?![A-Za-z])(.*?)(?:\\else(?![A-Za-z])(.*?))?\\fi(?![A-Za-z])")
_DROPPED = re.compile(
    r"\\(?:tableofcontents|renewcommand\{.*)|(?:\{\\\w+\s*)?\\input\{\w+\.bbl\}\}?"
)
_SPEC = re.compile(r"\\(?:begin\{(?:tabular|longtable)\}|multicolumn\{\d+\})(?=\{)")
_NUMBER = re.compile(
    r"(?:[^A-Za-z]|\\(?:ensuremath|cdot|infty|times|ge|le)(?![A-Za-z])|\b(?:to|of)\b)*\d"
    r"(?:[^A-Za-z]|\bloses\b)*"
)
_TAIL = re.compile(r"(\(|, )(\d[\d/, ]*)([)}]?(?:; \D*)?)$")  # last number: "holds (20/20); mixed"
# Citations show authors and years on web pages, and numbers in the PDF; "%" must follow its number.
_WEB = (
    (r"\((\\method\{[^{}]*\}) (\\cite\{[^{}]*\})\)", r"(\1) \2"),
    (r"\b(is|in|of|after)\s+\\cite\{", r"\1 \\citet{"),
    (r"\\,\\%", "\u202f\\\\%"),
)
_FIGURE = r"\begin{figure}\includegraphics{%s.pdf}\caption{%s}\label{fig:%s}\end{figure}"
# One-line definitions of TeX commands and theorems in the preamble, which pandoc can read.
# Definitions of layout commands are left out: `REPLACED` defines simpler commands of these names.
_SHORT = re.compile(
    r"(?m)^\\(?:newcommand\{\\(?!(?:longtableof|tablefile|pictureof|n|known)\})\w+\}.*\}|newtheorem.*)$"
)
REPLACED = r"""
\newcommand{\longtableof}[4]{\begin{table}\caption{#3}\label{#2}\input{#4}\end{table}}
\newcommand{\tablefile}[1]{\input{#1.tex}}
\newcommand{\pictureof}[2]{\begin{figure}\includegraphics{#1.pdf}\caption{#2}\label{fig:#1}\end{figure}}
"""


def prepared(source: str, document: str, origins: Mapping[str, Any], facts: Facts) -> str:
    """Return the ``source`` of a ``document`` for pandoc, with numbers as links to tables.

    ``origins`` is the content of numbers.json: the table cells of each number, and for each
    document which of its ``\\known`` blocks are shown. ``facts`` has the captions of figures.
    """
    preamble, begin, text = source.partition(r"\begin{document}")
    text = COMMENT.sub("", _decided(text, origins["known"][document]))
    text = PLACED.sub(lambda found: _FIGURE % (found[1], facts.captions[found[1]], found[1]), text)
    text = _PART.sub(lambda found: (found[1] if facts.part else found[2]) or "", text)
    text = text.replace(r"\timesnote", origins["times"])
    full = facts.full_study
    for name, words in {"configuration": facts.part or full, "fullstudy": full}.items():
        shown = rf"\texttt{{{escape(words)}}}".replace("\\", r"\\")
        text = re.sub(rf"\\{name}(?![A-Za-z])(?:\{{\}})?", shown, text)
    numbers = origins["numbers"]
    text = NAMED.sub(
        lambda found: _link(numbers[found[1]]["key"], numbers[found[1]]["text"]),
        _MATH.sub(_apart, text),
    )
    for pattern, shown in _WEB:
        text = re.sub(pattern, shown, text)
    text = _DROPPED.sub("", text.replace("{fittedtabular}", "{tabular}"))
    short = [found[0] for found in _SHORT.finditer(preamble)]
    return plain_columns("\n".join([*short, _title(preamble), REPLACED, begin, text]))


def _title(preamble: str) -> str:
    r"""Return the command ``\title`` of the ``preamble``, with colons in place of line breaks."""
    start = preamble.index(r"\title{") + len(r"\title{")
    lines = _PART.sub("", preamble[start : closing(preamble, start)]).split(r"\\")
    words = [re.sub(r"^\[[^\]]*\]|\\large|%", "", line).strip() for line in lines]
    return rf"\title{{{': '.join(words).replace('?:', '?')}}}"


def _decided(source: str, known: Sequence[str]) -> str:
    r"""Keep or drop each block ``\known`` as its decision in ``known`` says."""
    pieces, start = [], 0
    for sentence, decision in zip(sentences(source), known, strict=True):
        pieces += [source[start : sentence.start], sentence.text if decision == SHOWN else ""]
        start = sentence.end
    return "".join([*pieces, source[start:]])


def _apart(found: re.Match[str]) -> str:
    """Split a formula at its numbers (``\\n``), because a formula cannot contain a link."""
    if not NAMED.search(found[1]):
        return found[0]
    parts = re.split(r"(\\n\{[^{}]*\})", found[1])
    return "".join(p if p.startswith(r"\n{") else f"${p.strip()}$ " for p in parts if p.strip())


def _link(key: str, text: str) -> str:
    shown = _ENSURED.sub(r"$\1$", text)
    return rf"\href{{{ORIGIN}{key.encode().hex()}}}{{{shown}}}"


def linked_table(table: Rows, tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the TeX ``table`` with its numbers as links to rows of the study's tables.

    All links lead to the study's table that shares most columns with ``table``. If both tables have
    equally many rows, row i links to row i. Otherwise a row links to rows with equal cells in the
    shared columns, except columns in which no row has an equal cell (rounded numbers, titles).
    """
    (columns, header), *body = table
    origin = max(tables, key=lambda name: len({*header} & {*tables[name]}))
    one_to_one, rows = len(body) == len(tables[origin]), []
    for row, cells in enumerate(body, 1):
        own = [f"row={row}"] if one_to_one else _agreeing(tables[origin], header, cells)
        rows.append([_linked_cell(cell, "|".join([origin, *own])) for cell in cells])
    return plain_columns(_ENSURED.sub(r"$\1$", tabular(header, rows, columns)))


def _agreeing(table: pd.DataFrame, header: Sequence[str], cells: Sequence[str]) -> list[str]:
    """Return filters ``column=value`` that select rows with the ``cells`` of a TeX row."""
    found = []
    for title, cell in zip(header, cells, strict=True):
        shown = _plain(cell)
        for value in (shown, shown.replace(" ", "_"), code(shown)) if title in table else ():
            rows = matching(table, [(title, "=", value)])
            if len(rows):
                table = rows
                found.append(f"{title}={value}")
                break
    return found


def _linked_cell(cell: str, key: str) -> str:
    """Return ``cell`` with a link from its number (whole cell or end) to the rows ``key``."""
    if _NUMBER.fullmatch(cell):
        return _link(key, cell)
    cell = re.sub(r"^(\w+) (\d+)$", r"\1~\2", cell)  # "test 1" stays on one line
    return _TAIL.sub(lambda found: found[1] + _link(key, found[2]) + found[3], cell)


def _plain(cell: str) -> str:
    """Return a cell without backslashes; if it begins with ``\\texttt{x}``, only the x."""
    name = re.match(r"\\texttt\{([^{}]*)\}", cell)
    return (name[1] if name else cell).replace("\\", "")


def plain_columns(text: str) -> str:
    """Reduce the column definitions of all tables in ``text`` to letters that pandoc reads."""
    pieces, start = [], 0
    for found in _SPEC.finditer(text):
        begin, end = found.end() + 1, closing(text, found.end() + 1)
        spec = re.sub(r"[><@!]\{(?:[^{}]|\{[^{}]*\})*\}", "", text[begin:end])
        pieces += [text[start:begin], re.sub(r"[pm]\{[^{}]*\}|[XYZ]", "l", spec)]
        start = end
    return "".join([*pieces, text[start:]])
