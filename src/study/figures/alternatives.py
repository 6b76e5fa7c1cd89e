"""Figures of error against time: alternatives to projective dynamics, and tolerances."""

import numpy as np
import pandas as pd

from pdrom.model.held_out import FIRST, PLAYBACK
from pdrom.view import multiples, style
from pdrom.view.artists import Axes, Figure
from study.artifact.reads import TableOf
from study.experiments.alternatives.settings import REDUCTIONS
from study.figures.kit.declaration import NothingToDraw, Options, Scenes, figure

LOW, HIGH = 1e-4, 1.0  # limits of the error axis; errors outside are drawn on them
BESIDE = 4  # number of panels side by side
TOLERANCES, TIMES, REACHED = (5e-3, 2e-1), (1e-2, 1e1), (1e-4, 1e0)
# Colour of each outcome of a request, and a factor that shifts its dots along the tolerance axis.
KINDS = {
    "reduction": (style.BLUE, 0.85),
    "full order": (style.VERMILLION, 1.0),
    "refused": (style.GREY, 1.15),
}
BEST, DOT = ("full order, the best of all methods", style.BLACK), (0.55, 0.55, 0.55)
# Colour of the reduction by the number of motions that it is trained on.
TRAINED = {
    "reduction, one training motion": ("training_motions == 1", style.GREEN),
    "reduction, several training motions": ("training_motions > 1", style.BLUE),
}
BARE = "the same without the vertices"


@figure(
    title="Alternatives to projective dynamics",
    caption="""Error of whole trajectories against the implicit step solved to convergence, over the
    time per frame with the positions of all vertices, on the first held-out motion. Black: the best
    points of all full-order methods, whose settings are the grey dots. Colours: the best points of
    the reduction (ecsw) trained on frames of one motion or of several; dotted: without the time of
    the vertices. Dashed: playback of the training recording, which takes no time.
    $\\times 100$: the same scene with stiffer weights. Errors outside are drawn on the rim.""",
    reads={"table": TableOf("alternatives")},
)
def alternatives(options: Scenes, table: pd.DataFrame) -> Figure:
    """Draw a panel per scene, mesh and stiffness."""
    table = options.rows(table[table.motion == FIRST])
    cases = list(table.groupby(["scene", "vertices", "stiffness"]))
    if not cases:
        raise NothingToDraw("no alternatives")
    beside = min(BESIDE, len(cases))
    figure = style.new_figure(1.9 * multiples.rows_of(len(cases), beside) + 0.75)
    axes = multiples.panels(figure, len(cases), beside, sharey=True)
    for (labels, case), ax in zip(cases, axes, strict=True):
        _draw_case(ax, labels, case)
    multiples.label_outer(axes, beside, "ms a frame", y="relative error")
    drawn = {label: (colour, "o") for label, (_, colour) in TRAINED.items()}
    lines = [style.handle(BARE, color=style.GREEN, linestyle=":")]
    lines.append(style.handle("playback", color="#555555", linestyle="--"))
    style.legend(figure, [*style.handles({BEST[0]: (BEST[1], "o")} | drawn), *lines], 3)
    return figure


def _draw_case(ax: Axes, labels: tuple[str, int, float], case: pd.DataFrame) -> None:
    scene, vertices, stiffness = labels
    stiff = "" if stiffness == 1.0 else rf" $\times {stiffness:g}$"
    ax.set_title(f"{style.words(scene)}{stiff}, {vertices:,} vertices", fontsize=7.5)
    multiples.log_axis(ax, LOW, HIGH)
    multiples.time_axis(ax, case.ms_per_frame.to_numpy(float))
    rows = case.rename(columns={"error_implicit": "error"}).dropna(subset="error")
    for error in rows.error[rows.method == PLAYBACK]:
        ax.axhline(error, color="#555555", linestyle="--", linewidth=0.8)
    rows = rows[rows.ms_per_frame.notna()]
    inside = rows.method.isin(REDUCTIONS)
    full = rows[~inside]
    errors = multiples.clipped(full.error.to_numpy(float), LOW, HIGH)
    ax.plot(full.ms_per_frame, errors, ".", color=DOT, markersize=3.0)
    _draw_best(ax, full, BEST[1], "-")
    for trained, colour in TRAINED.values():
        own = rows[inside].query(trained)
        _draw_best(ax, own, colour, "-")
        _draw_best(ax, own.assign(ms_per_frame=own.ms_per_frame - own.vertices_ms), colour, ":")


def _draw_best(ax: Axes, rows: pd.DataFrame, colour: str, line: str) -> None:
    points = best_points(rows)
    errors = multiples.clipped(points.error.to_numpy(float), LOW, HIGH)
    marker = "o" if line == "-" else None
    ax.plot(
        points.ms_per_frame, errors, line, color=colour, marker=marker, markersize=3.2,
        linewidth=1.0,
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
