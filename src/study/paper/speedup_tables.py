"""Tables of the manuscript about what reductions gain and cost, as TeX, of ``tables``."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from pdrom.view.text import escape
from study.paper.macros import format_number
from study.paper.tabular import name, tabular
from study.tables.kit.intervals import in_words
from study.tables.winners import CURVE

Tables = Mapping[str, pd.DataFrame]
FULL = "full"  # position basis of unreduced positions


def speedups(tables: Tables) -> str:
    """Each quoted speed-up with its interval, its errors and what it costs."""
    rows = [
        [
            name(row.scene),
            name(_reduction(row)),
            _number(row.full_ms),
            escape(row.shown) + (" (loses)" if row.loses else ""),
            _number(row.error_train),
            _number(row.error_heldout),
            _number(row.training_s),
            _number(row.reduction_s),
            "never" if pd.isna(row.frames_to_break_even) else _whole(row.frames_to_break_even),
        ]
        for row in tables["speedups"].itertuples()
    ]
    header = ["scene", "reduction", "full ms", "speed-up", "training", "held out", "run (s)",
              "reduction (s)", "frames"]  # fmt: skip
    return tabular(header, rows, "llrlrrrrr")


def payoff(tables: Tables) -> str:
    """Numbers of scenes in which each reduction is accurate, pays, and loses."""
    rows = [
        [
            name(_model(row)),
            str(row.scenes),
            str(row.accurate),
            str(row.pays),
            str(row.loses),
            *(_number(v) for v in (row.least_speedup, row.best_speedup, row.most_speedup)),
            _number(row.error_train),
            f"{_number(row.error_heldout)} ({row.heldout})",
            str(row.accurate_heldout),
            str(row.pays_heldout),
        ]
        for row in tables["payoff"].itertuples()
    ]
    header = ["reduction", "runs in", "accurate in", "pays in", "loses in", "least", "median",
              "most", "training", "held out (of)", "accurate", "pays"]  # fmt: skip
    return tabular(header, rows, "lrrrrrrrrrrr")


def pays(tables: Tables) -> str:
    """Mesh sizes from which a reduction is faster than others, for each error that it reaches."""
    rows = []
    for _, curve in tables["winners"].groupby(CURVE, sort=False):
        row, smallest, largest = curve.iloc[0], curve.vertices.min(), curve.vertices.max()
        if not pd.isna(row.speedup):
            stiffness = "" if row.stiffness == 1.0 else rf" $\times {row.stiffness:g}$"
            rows.append(
                [
                    name(row.scene) + stiffness,
                    row.reference,
                    format_number(row.limit),
                    str(smallest) if smallest == largest else f"{smallest} to {largest}",
                    _size(row.from_plain),
                    _size(row.from_best),
                    in_words(row.speedup, row.speedup_low, row.speedup_high),
                    f"{row.reached} of {row.motions}",
                ]
            )
    header = ["scene", "against", "error", "vertices", "plain", "all", "speed-up", "motions"]
    return tabular(header, rows, "lllrrrrr")


def _size(vertices: Any) -> str:
    return "--" if pd.isna(vertices) else str(int(vertices))


def _model(row: Any) -> str:
    return row.method if row.position_basis == FULL else f"{row.method}, {row.position_basis}"


def _reduction(row: Any) -> str:
    size = f"r = {int(row.r)}" if row.position_basis == FULL else f"k = {int(row.k)}"
    return f"{row.method}, {size}"


def _number(value: float) -> str:
    return "--" if pd.isna(value) else format_number(value)


def _whole(value: float) -> str:
    """Two digits of a count, written out."""
    return str(int(float(f"{value:.1e}")))
