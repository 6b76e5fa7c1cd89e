"""How far may a reduced run go, how far does it, and does its iteration contract?"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pdrom.report.figures.bounds import Options
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import clipped, log_axis, rim_arrows
from pdrom.report.figures.kit.results import NothingToDraw, Results
from pdrom.tables.gain_prediction import FAILED, judged_runs

BOUNDS, EXTENTS = (1.0, 1e6), (0.5, 1e6)  # limits; what lies outside is drawn on the rim
NUMBERS, ERRORS = (0.5, 1e4), (1e-5, 1e2)
_KEYS = ["scene", "group", "method", "r"]


def draw(results: Results, options: Options) -> Figure:
    """Left a dot a run, bound against extent; right its contraction number against its error."""
    bounds = _chosen(results.table("bounds"), results, options)
    bounds = bounds[bounds.max_extent > 0.0]
    if bounds.empty:
        raise NothingToDraw("no run with a bound")
    reruns = results.table("reduced_reruns")
    runs = judged_runs(reruns, results.table("reconstruction_error"))
    runs = runs[[*_KEYS, "error"]].merge(bounds.dropna(subset=["contraction"]), on=_KEYS)
    figure = Figure(figsize=(style.WIDTH, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    methods = [m for m in results.holdings.methods if (bounds.method == m).any()]
    styles = style.method_styles(methods)
    for method in methods:
        _draw_extents(left, bounds[bounds.method == method], *styles[method])
        _dots(right, runs[runs.method == method], "contraction", "error", *styles[method])
    _finish_extents(left, bounds)
    _finish_errors(right)
    handles = [
        Line2D([], [], linestyle="none", color=c, marker=m, label=results.method_title(method))
        for method, (c, m) in styles.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _chosen(rows: pd.DataFrame, results: Results, options: Options) -> pd.DataFrame:
    """Rows of the scenes and methods that are asked for and held."""
    pairs = results.experiments(options)
    held = pd.MultiIndex.from_frame(rows[["scene", "group"]]).isin(pairs)
    return rows[held & rows.method.isin(results.methods(options))]


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
    rim_arrows(ax, across, along, colour, limits[x], limits[y])
    ax.plot(
        clipped(across, *limits[x]), clipped(along, *limits[y]),
        linestyle="none", color=colour, marker=marker, markersize=3.2, alpha=0.7,
        markeredgewidth=0.0, clip_on=False,
    )  # fmt: skip


def _finish_extents(ax: Axes, bounds: pd.DataFrame) -> None:
    log_axis(ax, *EXTENTS)
    ax.set_xscale("log")
    ax.set_xlim(*BOUNDS)
    ax.plot(BOUNDS, BOUNDS, color="#333333", linewidth=0.8, zorder=0)
    ax.set_xlabel("a-priori bound of the extent (rest extents)")
    ax.set_ylabel("largest extent of the run (rest extents)")
    least = float(np.nanmin(bounds.slack))
    ax.set_title(f"bound over extent: at least {least:.2g}")


def _finish_errors(ax: Axes) -> None:
    log_axis(ax, *ERRORS)
    ax.set_xscale("log")
    ax.set_xlim(*NUMBERS)
    ax.axhline(FAILED, color="#333333", linewidth=0.8, linestyle="--", zorder=0)
    ax.axvline(1.0, color="#333333", linewidth=0.8, linestyle=":", zorder=0)
    ax.text(NUMBERS[1], FAILED * 0.9, "failed above ", ha="right", va="top", fontsize=7)
    ax.text(1.15, ERRORS[0] * 1.3, "errors may grow", fontsize=7, va="bottom")
    ax.set_xlabel("contraction number of an iteration")
    ax.set_ylabel("error within the horizon (relative)")
