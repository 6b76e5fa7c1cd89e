"""Figures of error against time: alternatives to projective dynamics, and tolerances."""

import numpy as np
import pandas as pd

from pdrom.model.held_out import FIRST
from pdrom.view import multiples, style
from pdrom.view.artists import Axes, Figure
from study.artifact.reads import TableOf
from study.experiments.alternatives.settings import ACCELERATED, CONVERGED, REDUCED, TWO_LEVEL
from study.figures.kit.declaration import figure
from study.figures.kit.options import NothingToDraw, Options, Scenes

LOW, HIGH = 1e-4, 1.0  # limits of the error axis; errors outside are drawn on them
PAIRS = 2  # number of pairs of panels side by side
TOLERANCES, TIMES, REACHED = (5e-3, 2e-1), (1e-2, 1e1), (1e-4, 1e0)
# Colour of each outcome of a request, and a factor that shifts its dots along the tolerance axis.
KINDS = {
    "reduction": (style.BLUE, 0.85),
    "full order": (style.VERMILLION, 1.0),
    "refused": (style.GREY, 1.15),
}
LOOKS = {
    "projective": ("projective dynamics", style.BLACK, "o"),
    "anderson": ("with Anderson acceleration", style.GREY, "s"),
    "chebyshev": ("with Chebyshev acceleration", style.GREY, "<"),
    TWO_LEVEL: ("with a coarse level", style.GREY, ">"),
    "explicit": ("explicit (Verlet)", style.VERMILLION, "X"),
    REDUCED: ("POD subspace, ecsw", style.GREEN, "*"),
    ACCELERATED: ("the same, accelerated", style.GREEN, "p"),
}


@figure(
    title="Alternatives to projective dynamics",
    caption="""Error against time per frame on the first held-out motion, the best points of each
    method. Left of each pair the error against the implicit step of 16 ms solved to convergence,
    right the total error, against the motion in continuous time; the dashed line is the converged
    implicit step itself. Filled markers: one step a frame with more iterations; hollow ones: the
    frame divided into substeps. The reduction (ecsw) was trained on another motion, on its frames
    as they are or converged. $\\times 100$: the same scene with stiffer weights. Errors outside are
    drawn on the rim.""",
    reads={"table": TableOf("alternatives")},
)
def alternatives(options: Scenes, table: pd.DataFrame) -> Figure:
    """Draw a pair of panels (two references of the error) per scene, mesh and stiffness."""
    table = options.rows(table[table.motion == FIRST])
    cases = list(table.groupby(["scene", "vertices", "stiffness"]))
    if not cases:
        raise NothingToDraw("no alternatives")
    beside = min(PAIRS, len(cases))
    figure = style.new_figure(1.55 * multiples.rows_of(len(cases), beside) + 0.75)
    axes = multiples.panels(figure, 2 * len(cases), 2 * beside, sharey=True)
    for (labels, case), *pair in zip(cases, axes[::2], axes[1::2], strict=True):
        _draw_case(pair, labels, case)
    multiples.label_outer(axes, 2 * beside, "ms a frame", y="relative error")
    drawn = {label: look for m, (label, *look) in LOOKS.items() if (table.method == m).any()}
    style.legend(figure, style.handles(drawn, markersize=4), 4)
    return figure


def _draw_case(pair: list[Axes], labels: tuple[str, int, float], case: pd.DataFrame) -> None:
    scene, vertices, stiffness = labels
    stiff = "" if stiffness == 1.0 else rf" $\times {stiffness:g}$"
    name = f"{style.words(scene)}{stiff}, {vertices:,} vertices"
    for ax, reference in zip(pair, ("implicit", "continuous"), strict=True):
        multiples.log_axis(ax, LOW, HIGH)
        multiples.time_axis(ax, case.ms_per_frame.to_numpy(float))
        kind = "implicit step" if reference == "implicit" else "total error"
        ax.set_title(f"{name}\n{kind}", fontsize=7)
        rows = case.assign(error=case[f"error_{reference}"]).dropna(subset="error")
        own = rows[rows.method == CONVERGED]
        if reference == "continuous" and len(own):
            ax.axhline(own.error.iloc[0], color="#555555", linestyle="--", linewidth=0.8)
        for method, (_, colour, marker) in LOOKS.items():
            points = best_points(rows[rows.method == method])
            errors = multiples.clipped(points.error.to_numpy(float), LOW, HIGH)
            ax.plot(points.ms_per_frame, errors, color=colour, linewidth=0.9)
            divided = (points.substeps > 1).to_numpy(bool)
            for chosen, face in ((~divided, colour), (divided, "white")):
                ax.plot(
                    points.ms_per_frame[chosen], errors[chosen], color=colour, marker=marker,
                    markerfacecolor=face, linestyle="none", markersize=3.6, markeredgewidth=0.8,
                )  # fmt: skip


def best_points(rows: pd.DataFrame) -> pd.DataFrame:
    """Pareto-optimal ``rows`` in time and error, sorted from the fastest to the most accurate."""
    ordered = rows.sort_values(["ms_per_frame", "error"], kind="stable")
    before = ordered.error.cummin().shift(fill_value=np.inf)
    return ordered[ordered.error < before]


@figure(
    title="Requested tolerances and errors reached",
    caption="""A dot for each scene and held-out motion. Left: the error that a run reached against
    the tolerance that was requested; dots of met tolerances above their line are broken. Right: its
    time over that of a frame with the scene's own iterations, checks and failed levels included.
    What lies outside is drawn on the rim.""",
    reads={"table": TableOf("requested_tolerances")},
)
def requested_tolerances(options: Options, table: pd.DataFrame) -> Figure:
    """Draw errors (left) and relative times (right) against the requested tolerances."""
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
    multiples.log_axes(left, TOLERANCES, REACHED)
    multiples.log_axes(right, TOLERANCES, TIMES)
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
    """Draw ``values`` against ``tolerances`` as dots on ``ax``, if there are any.

    ``values`` beyond the ``limits`` are drawn on them. Without values, nothing is drawn.
    """
    if not values.empty:
        ax.plot(
            tolerances, multiples.clipped(np.asarray(values, float), *limits), "o",
            markersize=3.0, color=colour, alpha=0.7, clip_on=False,
        )  # fmt: skip
