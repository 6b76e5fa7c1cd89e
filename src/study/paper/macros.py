r"""TeX macros of the manuscript: numbers, captions, and decisions which sentences are shown.

The sentences in a block ``\known{... \n{name} ...}`` are left out if the study's tables have no row
for one of the numbers, or if one of the figures is not drawn.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import pandas as pd

from pdrom.core.errors import PaperError
from study.artifact.text import escape
from study.paper.numbers import Entries, is_held, names_of

PICTURE = re.compile(r"\\(?:figureof|pictureof)\{(\w+)\}")


def defined(kind: str, texts: Mapping[str, str]) -> str:
    """Return TeX macros ``kind@NAME`` with ``texts`` (NAME -> text): numbers, or captions."""
    made = [rf"\expandafter\def\csname {kind}@{k}\endcsname{{{text}}}" for k, text in texts.items()]
    return "\n".join(["% generated", r"\makeatletter", *made, r"\makeatother"]) + "\n"


_OPENING = re.compile(r"\\known\{")
_BRACE = re.compile(r"\\.|[{}]")  # a brace, or a backslash with the character that it escapes
SHOWN, DROPPED = "shown", "dropped"


class Sentence(NamedTuple):
    r"""Block ``\known``: content, and its slice of the TeX source."""

    text: str
    start: int
    end: int


def sentences(source: str) -> list[Sentence]:
    r"""Return all ``\known`` blocks of a TeX source, in order.

    Raises PaperError if a block is not closed or contains another block.
    """
    found: list[Sentence] = []
    for opening in _OPENING.finditer(source):
        if found and opening.start() < found[-1].end:
            raise PaperError(f"{source[found[-1].start :][:40]} ...: contains another \\known")
        end = closing(source, opening.end())
        found.append(Sentence(source[opening.end() : end], opening.start(), end + 1))
    return found


def decisions(
    source: str, known: Entries, tables: Mapping[str, pd.DataFrame], drawn: Collection[str] = ()
) -> list[str]:
    r"""Return `SHOWN` or `DROPPED` for each block ``\known``, by ``tables`` and ``drawn``."""
    return [
        SHOWN
        if {*PICTURE.findall(sentence.text)} <= {*drawn}
        and all(is_held(name, known, tables) for name in names_of(sentence.text))
        else DROPPED
        for sentence in sentences(source)
    ]


def provenance(
    decided: Mapping[str, Sequence[str]], part: str | None, full_study: str, times: str = ""
) -> str:
    r"""Return TeX definitions: ``\ifpart``, ``\timesnote``, configurations, decided blocks.

    decided : name of a document (``\jobname`` in TeX) -> result of `decisions` for its source
    part, full_study : as in class `Facts`; ``\ifpart`` is false if ``part`` is None
    times : sentence about unreliable times, or ""
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
    """Find the brace in ``source`` that closes the block whose content begins at ``start``."""
    depth = 1
    for brace in _BRACE.finditer(source, start):
        depth += {"{": 1, "}": -1}.get(brace[0], 0)
        if depth == 0:
            return brace.start()
    raise PaperError(f"{source[start - 1 : start + 40]} ...: the brace is not closed")
