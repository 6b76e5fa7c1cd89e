"""Requested tolerances, the errors reached, and what they cost."""

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.multiples import clipped, log_axes
from study.artifact.reads import TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import NothingToDraw, Options

TOLERANCES, TIMES, REACHED = (5e-3, 2e-1), (1e-2, 1e1), (1e-4, 1e0)
# Colour of each kind of answer, and a factor that moves its dots along the axis of tolerances.
KINDS = {
    "reduction": (style.BLUE, 0.85),
    "full order": (style.VERMILLION, 1.0),
    "refused": (style.GREY, 1.15),
}


@figure(
    title="Requested tolerances and errors reached",
    caption=(
        "A dot for each scene and held-out motion. Left: the error that a run reached against the "
        "tolerance that was requested; dots of met tolerances above their line are broken. Right: "
        "its time over that of a frame with the scene's own iterations, checks and failed levels "
        "included. What lies outside is drawn on the rim."
    ),
    reads={"table": TableOf("requested_tolerances")},
    options=Options,
)
def requested_tolerances(options: Options, table: pd.DataFrame) -> Figure:
    """Draw errors and times side by side."""
    table = table[table.error.notna()]
    if table.empty:
        raise NothingToDraw("no tolerance was requested")
    chart = style.new_figure(3.2)
    left, right = chart.subplots(1, 2)
    met, reduced = table.met.astype(bool), table.reduced.astype(bool)
    looks = {}
    for (kind, (colour, shift)), chosen in zip(
        KINDS.items(), (met & reduced, met & ~reduced, ~met), strict=True
    ):
        own = table[chosen]
        if not own.empty:
            looks[kind] = (colour, "o")
        dots(left, shift * own.tolerance, own.error, REACHED, colour)
        dots(right, shift * own.tolerance, own.over_own, TIMES, colour)
    log_axes(left, TOLERANCES, REACHED)
    log_axes(right, TOLERANCES, TIMES)
    for tolerance in table.tolerance.unique():
        ends = [0.78 * tolerance, 1.28 * tolerance]
        left.plot(ends, [tolerance, tolerance], color="#333333", linewidth=1.2)
    right.axhline(1.0, color="#333333", linewidth=0.8)
    left.set_ylabel("reached error")
    right.set_ylabel("time over that of own iterations")
    for ax in (left, right):
        ax.set_xlabel("requested tolerance")
    style.legend(chart, style.handles(looks, linestyle="none", markersize=4), 3)
    return chart


def dots(
    ax: Axes, tolerances: pd.Series, values: pd.Series, limits: tuple[float, float], colour: str
) -> None:
    """Draw a dot on ``ax`` for each pair; none, not clipped, would take all the room of the axes.

    ``values`` beyond the ``limits`` are drawn on them.
    """
    if not values.empty:
        ax.plot(
            tolerances, clipped(np.asarray(values, float), *limits), "o",
            markersize=3.0, color=colour, alpha=0.7, clip_on=False,
        )  # fmt: skip
