"""Tables of the manuscript about claims of the preprint, as TeX, made of ``tables``."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from pdrom.view.text import escape
from study.figures.kit.declaration import declarations
from study.paper.macros import format_number
from study.paper.tabular import longtable, name, tabular

Tables = Mapping[str, pd.DataFrame]
_VERDICT_COLOUR = {"holds": "okgreen", "does not hold": "okred"}
_PARTS = {"published": "as published", "beyond": "beyond"}
# Where the manuscript shows what a claim without a figure rests on.
_SHOWN = {"C11": "reruns", "C12": "positions"}
_SIGNS = {">=": r"$\ge$", "<=": r"$\le$"}


def claims(tables: Tables) -> str:
    """Both verdicts on each claim, with how many rows agree in the tests that decide it."""
    tests = tables["claims_tests"]
    tests = tests[tests.decides.astype(bool)]
    rows = []
    for row in tables["claims"].itertuples():
        mine = tests[tests.claim == row.claim]
        cells = [
            _verdict(verdict, mine[mine.part == part])
            for part, verdict in zip(_PARTS, (row.verdict, row.verdict_beyond), strict=True)
        ]
        rows.append([row.claim, escape(row.paper), *cells, _place(row.claim, row.figure_or_table)])
    header = ["claim", "the preprint says", "as published", "beyond", "shown in"]
    left = r">{\raggedright\arraybackslash}"
    return tabular(header, rows, rf"l{left}p{{4.7cm}}{left}p{{3.2cm}}{left}p{{4.1cm}}l")


def _verdict(verdict: str, tests: pd.DataFrame) -> str:
    colour = _VERDICT_COLOUR.get(verdict, "okgrey")
    counted = ", ".join(f"{test.satisfied}/{test.of}" for test in tests.itertuples())
    return rf"\textcolor{{{colour}}}{{{escape(verdict)}}} ({counted})"


def _place(claim: str, shown: str) -> str:
    """A figure or a table of the manuscript by its number, a table of results by its name."""
    if claim in _SHOWN:
        return rf"table~\ref{{tab:{_SHOWN[claim]}}}"
    return rf"figure~\ref{{fig:{shown}}}" if shown in declarations() else name(shown)


def claims_in_full(tables: Tables) -> str:
    """Each claim in words, where it stands, and every test of it with what was found."""
    tests = tables["claims_tests"]
    rows = []
    for row in tables["claims"].itertuples():
        rows += _words(row)
        for part, title in _PARTS.items():
            found = tests[(tests.claim == row.claim) & (tests.part == part)]
            for place, test in enumerate(found.itertuples()):
                rows.append(["" if place else rf"\emph{{{title}}}", *_test(test)])
    header = ["", "test", "limit", "rows", "least", "median", "most"]
    return longtable(header, rows, r"l>{\raggedright\arraybackslash}p{6.5cm}lrrrr")


def _words(row: Any) -> list[list[str]]:
    """The claim, and how its rules came about: rows of one cell, below some space."""
    place = f"Section {escape(row.section)}, figures: {escape(row.shown)}."
    qualified = rf"\emph{{Qualifiers:}} {escape(row.qualifiers)}. \emph{{{place}}}"
    stated = rf"\textbf{{{row.claim}}} {escape(row.text)} {qualified}"
    return [
        [r"\noalign{\smallskip}" + _across(stated)],
        [_across(rf"\emph{{History of the rules:}} {escape(row.history)}")],
    ]


def _across(text: str) -> str:
    return rf"\multicolumn{{7}}{{>{{\raggedright\arraybackslash}}p{{15.3cm}}}}{{{text}}}"


def _test(row: Any) -> list[str]:
    """Describe a test: its limit, how many rows satisfy it, and the range of the values."""
    what = escape(row.what) if row.decides else rf"\textcolor{{okgrey}}{{{escape(row.what)}}}"
    spread = (row.least, row.median, row.most)
    values = ["--" if pd.isna(value) else format_number(value) for value in spread]
    limit = f"{_SIGNS[row.compare]} {format_number(row.threshold)}"
    return [what, limit, f"{row.satisfied} of {row.of}", *values]
