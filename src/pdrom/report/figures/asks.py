"""Asked errors against those reached, and what they cost."""

import numpy as np
import pandas as pd

from pdrom.artifact.reads import TableOf
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Axes, Figure
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.multiples import clipped, log_axes
from pdrom.report.figures.kit.options import Options
from pdrom.report.figures.kit.results import NothingToDraw, Results

ERRORS, TIMES, REACHED = (5e-3, 2e-1), (1e-2, 1e1), (1e-4, 1e0)
# Shift of the dots of a kind along the ask, as a factor.
KINDS = {
    "reduction": (style.BLUE, 0.85),
    "full order": (style.VERMILLION, 1.0),
    "no promise": (style.GREY, 1.15),
}


@figure(
    title="Asked and reached errors",
    caption=(
        "A dot for each scene and held-out motion that can be judged. Left: the error that a run "
        "reached against the one that was asked for; promises above its line are broken. Right: "
        "its time over that of a frame with the scene's own iterations, checks and repairs "
        "included; crosses are the fastest way that keeps to the ask, known by hindsight only. "
        "What lies outside is drawn on the rim."
    ),
    reads=(TableOf("asks"),),
    options=Options,
)
def asks(results: Results, options: Options) -> Figure:
    """Draw errors and times beside each other."""
    table = results.table("asks")
    table = table[table.judged.astype(bool)]
    if table.empty:
        raise NothingToDraw("no ask was run")
    chart = style.new_figure(3.2)
    left, right = chart.subplots(1, 2)
    promised, reduced = table.promised.astype(bool), table.reduced.astype(bool)
    parts = (promised & reduced, promised & ~reduced, ~promised)
    looks = {}
    for (kind, (colour, shift)), chosen in zip(KINDS.items(), parts, strict=True):
        own = table[chosen]
        if not own.empty:
            looks[kind] = (colour, "o")
        _dots(left, shift * own.asked, own.error, REACHED, colour)
        _dots(right, shift * own.asked, own.ms_per_frame / own.own_ms, TIMES, colour)
    best = table[table.oracle_ms.notna()]
    _dots(right, 1.3 * best.asked, best.oracle_ms / best.own_ms, TIMES, "#333333", marker="x")
    if not best.empty:
        looks["by hindsight"] = ("#333333", "x")
    log_axes(left, ERRORS, REACHED)
    log_axes(right, ERRORS, TIMES)
    for asked in table.asked.unique():
        left.plot([0.78 * asked, 1.28 * asked], [asked, asked], color="#333333", linewidth=1.2)
    right.axhline(1.0, color="#333333", linewidth=0.8)
    left.set_ylabel("reached error")
    right.set_ylabel("time over that of own iterations")
    for ax in (left, right):
        ax.set_xlabel("asked error")
    style.legend(chart, style.handles(looks, linestyle="none", markersize=4), 4)
    return chart


def _dots(
    ax: Axes,
    asked: pd.Series,
    values: pd.Series,
    limits: tuple[float, float],
    colour: str,
    marker: str = "o",
) -> None:
    if values.empty:  # dots that are none, and not clipped, would take all the room of the axes
        return
    ax.plot(
        asked, clipped(np.asarray(values, float), *limits), marker,
        markersize=3.0, color=colour, alpha=0.7, clip_on=False,
    )  # fmt: skip
