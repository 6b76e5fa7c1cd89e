"""Tables of the manuscript about the claims of the paper, as TeX."""

from collections.abc import Mapping

import pandas as pd

from pdrom.report.paper.tabular import longtable, name
from pdrom.report.words.text import escape

Tables = Mapping[str, pd.DataFrame]
_VERDICT_COLOUR = {"holds": "okgreen", "does not hold": "okred"}


def claims(tables: Tables) -> str:
    """Both verdicts on each claim, with what was measured."""
    rows = []
    for row in tables["claims"].itertuples():
        cells = [
            _verdict(row.verdict, row.measured), _verdict(row.verdict_beyond, row.measured_beyond)
        ]  # fmt: skip
        rows.append([row.claim, escape(row.paper), *cells, name(row.figure_or_table)])
    header = ["claim", "the preprint says", "as published", "beyond", "shown in"]
    left = r">{\raggedright\arraybackslash}"
    return longtable(header, rows, rf"l{left}p{{3.2cm}}{left}p{{3.4cm}}{left}p{{3.4cm}}l")


def _verdict(verdict: str, measured: str) -> str:
    colour = _VERDICT_COLOUR.get(verdict, "okgrey")
    shown = escape(str(measured)).replace("; ", r"; \newline ")
    return rf"\textcolor{{{colour}}}{{{escape(verdict)}}}\newline {shown}"


def claims_in_full(tables: Tables) -> str:
    """Where each claim stands, with its qualifiers, and every test on it in words."""
    rows = []
    for row in tables["claims"].itertuples():
        place = [f"section {escape(row.section)}", f"figures: {escape(row.shown)}"]
        said = [escape(row.text), rf"\emph{{Qualifiers:}} {escape(row.qualifiers)}."]
        tests = [
            rf"\emph{{As published:}} {escape(row.why)}",
            rf"\emph{{Beyond:}} {escape(row.why_beyond)}",
            rf"\emph{{Rules:}} {escape(row.history)}",
        ]
        cells = [r" \newline ".join(part) for part in (place, said, tests)]
        rows.append([row.claim, *cells])
    left = r">{\raggedright\arraybackslash}"
    header = ["claim", "where", "what the preprint says", "tests"]
    return longtable(header, rows, rf"l{left}p{{1.9cm}}{left}p{{4.1cm}}{left}p{{7.6cm}}")
