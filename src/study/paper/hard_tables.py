"""Tables of the manuscript about hard cases, as TeX, made of ``tables``."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from pdrom.view.text import escape
from study.experiments.hard_cases.catalogue import CASES
from study.experiments.hard_cases.outcomes import FAILURES, HOLDS, NOT_TAKEN, NOTHING
from study.paper.macros import format_number
from study.paper.tabular import longtable, name

Tables = Mapping[str, pd.DataFrame]


def hard_cases(tables: Tables) -> str:
    """Hard cases in which some reduction fails: what makes them hard, and how each one fails."""
    table = tables["hard_cases"]
    failed = table[table.outcome.isin(FAILURES)]
    rows = []
    for case, part in failed.groupby("case", sort=False):
        how = [f"{name(row.method)}: {_failure(row)}" for row in part.itertuples()]
        rows.append([name(case), escape(CASES[case].why), r" \newline ".join(how)])
    left = r">{\raggedright\arraybackslash}"
    header = ["case", "why it is hard", "how each reduction fails"]
    return longtable(header, rows, rf"l{left}p{{4.6cm}}{left}p{{6.0cm}}")


def _failure(row: Any) -> str:
    """Failure of a reduction, with what tells it apart from others."""
    if row.outcome == "singular":
        return "singular"
    if row.outcome == "blow-up":
        text = f"blow-up, {int(row.blowup_frame)}"
    elif row.outcome == "distorted":
        text = rf"{format_number(row.max_extent)}\,$\times$ the extent"
    else:
        text = escape(row.outcome)
    return text if pd.isna(row.gain) else rf"{text}; gain {format_number(row.gain)}"


def hard_reductions(tables: Tables) -> str:
    """Every reduction over the hard cases: how many it passes, how it fails, and why."""
    rows = []
    reported: dict[str, str] = {}  # reasons, by the first reduction that has them
    for method, part in tables["hard_cases"].groupby("method", sort=False):
        count = part.outcome.value_counts()
        failed = part[part.outcome.isin(FAILURES)]
        why = failed.why.dropna()
        outcomes = (HOLDS, NOTHING, NOT_TAKEN, "singular", "blow-up")
        cells = [count.get(outcome, 0) for outcome in outcomes]
        other = len(part) - sum(cells)
        reason = str(why.iloc[0]) if len(why) else "--"
        first = reported.setdefault(reason, method)
        shown = escape(reason) if first == method or reason == "--" else f"as {name(first)}"
        rows.append([name(method), *(str(c) for c in (*cells, other)), shown])
    header = [
        "reduction", "holds", "nothing", "not taken", "singular", "blow-up", "distorted",
        "why it fails",
    ]  # fmt: skip
    left = r">{\raggedright\arraybackslash}"
    return longtable(header, rows, rf"lrrrrrr{left}p{{5.2cm}}")
