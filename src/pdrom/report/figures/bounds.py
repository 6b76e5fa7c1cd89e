"""Bounds known before a run: of its extent, and of whether its iteration contracts."""

import numpy as np
import pandas as pd

from pdrom.artifact.reads import TableOf
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Axes, Figure
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.multiples import clipped, log_axes, rim_arrows
from pdrom.report.figures.kit.options import Experiments, Methods
from pdrom.report.figures.kit.results import NothingToDraw, Results
from pdrom.tables.gain_prediction import FAILED, judged_runs

BOUNDS, EXTENTS = (1.0, 1e6), (0.5, 1e6)  # limits; what lies outside is drawn on the rim
NUMBERS, ERRORS = (0.5, 1e4), (1e-5, 1e2)
_KEYS = ["scene", "group", "method", "r"]


class Options(Experiments, Methods):
    """Choices."""


@figure(
    title="Bounds known before a run",
    caption=(
        "Left: the largest extent of every run against its a-priori bound (theorem 1), both in "
        "rest extents. On the line they are equal; where no contact acts, no dot may lie above it. "
        "Ringed: what the study "
        "calls a blow-up. Right: the error of every run whose basis suffices "
        "against the contraction number of its iteration, over all scenes with a single group. "
        "Left of the dotted line an error shrinks in every iteration. Dashed: the error from "
        "which on a run counts as failed. Arrows on the rim lie outside the axes."
    ),
    reads=(TableOf("bounds"), TableOf("reduced_reruns"), TableOf("reconstruction_error")),
    options=Options,
)
def bounds(results: Results, options: Options) -> Figure:
    """Draw a dot a run: left bound against extent, right contraction number against error."""
    bounds = results.held_rows(results.table("bounds"), options)
    bounds = bounds[bounds.max_extent > 0.0]
    if bounds.empty:
        raise NothingToDraw("no run with a bound")
    reruns = results.table("reduced_reruns")
    runs = judged_runs(reruns, results.table("reconstruction_error"))
    runs = runs[[*_KEYS, "error"]].merge(bounds.dropna(subset=["contraction"]), on=_KEYS)
    figure = style.new_figure(3.4)
    left, right = figure.subplots(1, 2)
    methods = [m for m in results.holdings.methods if (bounds.method == m).any()]
    styles = style.method_styles(methods)
    for method in methods:
        _draw_extents(left, bounds[bounds.method == method], *styles[method])
        _dots(right, runs[runs.method == method], "contraction", "error", *styles[method])
    _finish_extents(left, bounds)
    _finish_errors(right)
    style.legend(figure, style.method_handles(results, styles, linestyle="none"), 4)
    return figure


def _draw_extents(ax: Axes, runs: pd.DataFrame, colour: str, marker: str) -> None:
    _dots(ax, runs, "bound", "max_extent", colour, marker)
    gone = runs[runs.finite.astype(str) == "False"]
    if gone.empty:
        return
    bound = clipped(gone.bound.to_numpy(float), *BOUNDS)
    extent = clipped(gone.max_extent.to_numpy(float), *EXTENTS)
    ax.plot(
        bound, extent, "o", markersize=7.0, markerfacecolor="none", markeredgecolor=style.FAILED,
        clip_on=False,
    )  # fmt: skip


def _dots(ax: Axes, runs: pd.DataFrame, x: str, y: str, colour: str, marker: str) -> None:
    # an empty line that is not clipped would count for the layout
    if runs.empty:
        return
    limits = {"bound": BOUNDS, "max_extent": EXTENTS, "contraction": NUMBERS, "error": ERRORS}
    across, along = runs[x].to_numpy(float), runs[y].to_numpy(float)
    rim_arrows(ax, across, along, colour=colour, across=limits[x], along=limits[y])
    ax.plot(
        clipped(across, *limits[x]), clipped(along, *limits[y]),
        linestyle="none", color=colour, marker=marker, markersize=3.2, alpha=0.7,
        markeredgewidth=0.0, clip_on=False,
    )  # fmt: skip


def _finish_extents(ax: Axes, bounds: pd.DataFrame) -> None:
    log_axes(ax, BOUNDS, EXTENTS)
    ax.plot(BOUNDS, BOUNDS, color="#333333", linewidth=0.8, zorder=0)
    ax.set_xlabel("a-priori bound of the extent (rest extents)")
    ax.set_ylabel("largest extent of the run (rest extents)")
    least = float(np.nanmin(bounds.slack))
    ax.set_title(f"bound over extent: at least {least:.2g}")


def _finish_errors(ax: Axes) -> None:
    log_axes(ax, NUMBERS, ERRORS)
    ax.axhline(FAILED, color="#333333", linewidth=0.8, linestyle="--", zorder=0)
    ax.axvline(1.0, color="#333333", linewidth=0.8, linestyle=":", zorder=0)
    ax.text(NUMBERS[1], FAILED * 0.9, "failed above ", ha="right", va="top", fontsize=7)
    ax.text(1.15, ERRORS[0] * 1.3, "errors may grow", fontsize=7, va="bottom")
    ax.set_xlabel("contraction number of an iteration")
    ax.set_ylabel("error within the horizon (relative)")
