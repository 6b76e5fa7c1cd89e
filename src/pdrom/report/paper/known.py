r"""Sentences of the manuscript whose numbers a configuration may not hold.

The source wraps them: ``\known{... \val{key} ...}``. Where one of the keys is not held, the
sentence is left out, and the first one of a paragraph is replaced by a note that says which
configuration holds it.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from pdrom.core.errors import PaperError
from pdrom.report.paper.macros import is_held, keys_of
from pdrom.report.words.text import escape

_OPENING = r"\known{"
_BRACE = re.compile(r"(?<!\\)[{}]")
_BLANK_LINE = re.compile(r"\n[ \t]*\n")
SHOWN, NOTED, DROPPED = "shown", "noted", "dropped"


@dataclass(frozen=True)
class Sentence:
    """Text of a block, and the number of its paragraph."""

    text: str
    paragraph: int


def sentences(source: str) -> list[Sentence]:
    r"""Every ``\known`` block of a TeX source, in order.

    Raises
    ------
    PaperError
        A block is not closed, or holds another one.
    """
    found = []
    start = source.find(_OPENING)
    while start >= 0:
        inside = start + len(_OPENING)
        end = _closing(source, inside)
        text = source[inside:end]
        if _OPENING in text:
            raise PaperError(f"{_OPENING}{text[:40]} ...: holds another one")
        found.append(Sentence(text, len(_BLANK_LINE.findall(source[:start]))))
        start = source.find(_OPENING, end)
    return found


def decisions(source: str, tables: Mapping[str, pd.DataFrame]) -> list[str]:
    """What becomes of every block: shown, noted (left out with a note) or dropped."""
    made, noted = [], set()
    for sentence in sentences(source):
        if all(is_held(key, tables) for key in keys_of(sentence.text)):
            made.append(SHOWN)
        else:
            made.append(DROPPED if sentence.paragraph in noted else NOTED)
            noted.add(sentence.paragraph)
    return made


def provenance(decided: Sequence[str], part: str | None, full_study: str) -> str:
    r"""TeX of ``\known``, of the note, and of what a manuscript says that is not of the full study.

    ``\ifpart`` is true where ``part`` names what the study was read from, ``\configuration``.
    """
    note = (
        rf"The full study (\texttt{{{escape(full_study)}}}) holds the numbers of sentences that "
        "are left out here."
        if part is not None
        else "Sentences are left out here whose numbers this study does not hold."
    )
    lines = [
        r"\newif\ifpart",
        r"\parttrue" if part is not None else r"\partfalse",
        rf"\newcommand{{\configuration}}{{\texttt{{{escape(part or full_study)}}}}}",
        rf"\newcommand{{\fullstudy}}{{\texttt{{{escape(full_study)}}}}}",
        r"\makeatletter",
        r"\newcounter{known}",
        r"\let\known@shown\@firstofone",
        rf"\newcommand{{\known@noted}}[1]{{\textcolor{{okgrey}}{{[{note}]}}}}",
        r"\let\known@dropped\@gobble",
        r"\newcommand{\known}[1]{\stepcounter{known}\csname known@\arabic{known}\endcsname{#1}}",
    ]
    for number, decision in enumerate(decided, start=1):
        lines.append(rf"\expandafter\let\csname known@{number}\endcsname\known@{decision}")
    return "\n".join([*lines, r"\makeatother"]) + "\n"


def _closing(source: str, start: int) -> int:
    """Place of the brace that closes a block which begins at ``start``."""
    depth = 1
    for brace in _BRACE.finditer(source, start):
        depth += 1 if brace[0] == "{" else -1
        if depth == 0:
            return brace.start()
    raise PaperError(f"{_OPENING}{source[start : start + 40]} ...: is not closed")
