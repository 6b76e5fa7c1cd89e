r"""Sentences and rows of the manuscript whose numbers a configuration may not hold.

The source wraps them: ``\known{... \val{key} ...}`` is a sentence, ``\row{... & \val{key} \\}`` a
row of a table. Where one of the keys is not held it is left out, and the first such sentence of a
paragraph is replaced by a note that says which configuration holds it; a row goes without one.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from pdrom.core.errors import PaperError
from pdrom.view.text import escape
from study.paper.macros import is_held, keys_of

_OPENING = re.compile(r"\\(known|row)\{")
_BRACE = re.compile(r"\\.|[{}]")  # a brace, or an escape, which may be one of a brace
_BLANK_LINE = re.compile(r"\n[ \t]*\n")
SHOWN, NOTED, DROPPED = "shown", "noted", "dropped"


@dataclass(frozen=True)
class Sentence:
    """Text of a block, the number of its paragraph, and whether it is a row of a table."""

    text: str
    paragraph: int
    is_row: bool


def sentences(source: str) -> list[Sentence]:
    r"""Every ``\known`` and ``\row`` block of a TeX source, in order.

    Raises
    ------
    PaperError
        A block is not closed, or holds another one.
    """
    found: list[Sentence] = []
    opening = _OPENING.search(source)
    while opening:
        end = closing(source, opening.end())
        text = source[opening.end() : end]
        if _OPENING.search(text):
            raise PaperError(f"{opening[0]}{text[:40]} ...: holds another one")
        paragraph = len(_BLANK_LINE.findall(source[: opening.start()]))
        found.append(Sentence(text, paragraph, is_row=opening[1] == "row"))
        opening = _OPENING.search(source, end)
    return found


def decisions(source: str, tables: Mapping[str, pd.DataFrame]) -> list[str]:
    """Decide for every block of ``source``: shown, noted (left out with a note) or dropped."""
    made, noted = [], set()
    for sentence in sentences(source):
        if all(is_held(key, tables) for key in keys_of(sentence.text)):
            made.append(SHOWN)
        elif sentence.is_row:
            made.append(DROPPED)
        else:
            made.append(DROPPED if sentence.paragraph in noted else NOTED)
            noted.add(sentence.paragraph)
    return made


def provenance(decided: Mapping[str, Sequence[str]], part: str | None, full_study: str) -> str:
    r"""TeX of ``\known`` and ``\row``, of the note, and of what a manuscript of a part says.

    What was decided of the blocks of each document stands under its name, which is TeX's
    ``\jobname``. ``\ifpart`` is true where ``part`` names what the study was read from,
    ``\configuration``; ``full_study`` is the name of the full one.
    """
    lines = [
        r"\newif\ifpart",
        r"\parttrue" if part is not None else r"\partfalse",
        rf"\newcommand{{\configuration}}{{\texttt{{{escape(part or full_study)}}}}}",
        rf"\newcommand{{\fullstudy}}{{\texttt{{{escape(full_study)}}}}}",
        r"\makeatletter",
        r"\newcounter{known}",
        r"\let\known@shown\@firstofone",
        rf"\newcommand{{\known@noted}}[1]{{\textcolor{{okgrey}}{{[{note(part, full_study)}]}}}}",
        r"\let\known@dropped\@gobble",
        r"\newcommand{\known@next}{\csname known@\jobname @\arabic{known}\endcsname}",
        r"\newcommand{\known}[1]{\stepcounter{known}\known@next{#1}}",
        # a row that is left out must not open a cell
        r"\newcommand{\row}[1]{\noalign{\stepcounter{known}}\known@next{#1}}",
    ]
    for document, made in decided.items():
        for number, decision in enumerate(made, start=1):
            name = f"known@{document}@{number}"
            lines.append(rf"\expandafter\let\csname {name}\endcsname\known@{decision}")
    return "\n".join([*lines, r"\makeatother"]) + "\n"


def note(part: str | None, full_study: str) -> str:
    """TeX in place of sentences that are left out, see `provenance`."""
    if part is None:
        return "Sentences are left out here whose numbers this study does not hold."
    full = rf"\texttt{{{escape(full_study)}}}"
    return f"The full study ({full}) holds the numbers of sentences that are left out here."


def closing(source: str, start: int) -> int:
    """Place in ``source`` of the brace that closes a block which begins at ``start``."""
    depth = 1
    for brace in _BRACE.finditer(source, start):
        depth += {"{": 1, "}": -1}.get(brace[0], 0)
        if depth == 0:
            return brace.start()
    raise PaperError(f"{source[start - 1 : start + 40]} ...: is not closed")
