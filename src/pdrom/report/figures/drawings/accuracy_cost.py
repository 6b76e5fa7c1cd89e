"""Accuracy of reduced models against their time per frame."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from pdrom.experiments.names import ANDERSON, FOM
from pdrom.report.figures.accuracy_cost import Options
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import clipped, label_outer, log_axis, small_multiples
from pdrom.report.figures.kit.results import NothingToDraw, Results
from pdrom.tables.accuracy_cost import FEWER

COLUMNS = [
    "scene", "method", "position_basis", "iterations", "relative_error_within_horizon",
    "ms_per_frame", "pareto",
]  # fmt: skip
LOW, HIGH = 1e-6, 1e2  # errors outside are drawn on the limit
RATES = (60, 30)  # frames per second
ERROR, TIME = "relative_error_within_horizon", "ms_per_frame"
_FEWER = {"color": style.BLACK, "marker": "x", "linewidth": 0.8, "linestyle": (0, (1, 1))}
_BLIND = {"color": style.FAILED, "linewidth": 0.9, "linestyle": "-."}
_RATE = {"color": "#8A857A", "linewidth": 0.8, "linestyle": "--"}


def draw(results: Results, options: Options) -> Figure:
    """A panel per scene, a dot per reduced model; the best trade-offs are joined and ringed.

    All errors of dots are against the scene's own full-order run, whose time is a vertical line.
    That run's own error, against the converged one, is a horizontal line: what lies below it
    cannot be seen. Errors outside the axis lie on its rim.

    Raises
    ------
    StorageError
        The table is missing or lacks a column.
    """
    table = results.table("accuracy_cost", COLUMNS).dropna(subset=[ERROR, TIME])
    own = (table.method == "full") & (table.position_basis == "full")
    full_order = table[own].set_index("scene")
    fom = table[table.method == FOM].set_index(["scene", "iterations"])[ERROR]
    blind = {
        scene: fom[scene, k] for scene, k in full_order.iterations.items() if (scene, k) in fom
    }
    table = table[
        (table[ERROR] > 0.0) & (table[TIME] > 0.0) & ~own & ~table.method.isin([FOM, ANDERSON])
    ]
    table["method"] = [model_name(row) for row in table.itertuples()]
    if options.methods:
        table = table[table.method.isin([*options.methods, FEWER])]
    held = results.scenes(options)
    scenes = [scene for scene in held if (table.scene == scene).any()]
    if not scenes:
        raise NothingToDraw("no reduced model with both an error and a time")
    figure, axes = small_multiples(len(scenes), options.columns, legend_rows=5, height=1.8)
    table = table[table.scene.isin(scenes)]
    methods = [m for m in dict.fromkeys(table.method) if m != FEWER]
    styles = style.method_styles(methods)
    for ax, scene in zip(axes, scenes, strict=True):
        own_time = full_order[TIME].get(scene)
        _draw_scene(ax, table[table.scene == scene], styles, own_time, blind.get(scene))
        ax.set_title(style.words(scene))
    label_outer(axes, options.columns, "time per frame (ms)", "relative error")
    _legend(figure, results, styles)
    return figure


def model_name(row: Any) -> str:
    """Method of a row; in a position subspace its kind comes first."""
    if row.position_basis == "full":
        return str(row.method)
    subspace = f"{row.position_basis} subspace"
    return subspace if row.method == "full" else f"{subspace}, {row.method}"


def _draw_scene(
    ax: Axes,
    rows: pd.DataFrame,
    styles: dict[str, tuple[str, str]],
    full_order: float | None,
    blind: float | None,
) -> None:
    ax.set_xscale("log")
    log_axis(ax, LOW, HIGH)
    rows = rows.assign(**{ERROR: clipped(rows[ERROR].to_numpy(float), LOW, HIGH)})
    time = rows[TIME].to_numpy(float)
    for method, part in rows[rows.method != FEWER].groupby("method", sort=False):
        colour, marker = styles[str(method)]
        ax.plot(
            part[TIME], part[ERROR], linestyle="none",
            color=colour, marker=marker, markersize=3.8, alpha=0.85,
        )  # fmt: skip
    fewer = rows[rows.method == FEWER].sort_values("iterations")
    ax.plot(fewer[TIME], fewer[ERROR], markersize=4.5, zorder=1.5, **_FEWER)
    for row in fewer.itertuples():
        _label_iterations(ax, row.ms_per_frame, row.relative_error_within_horizon, row.iterations)
    best = rows[rows.pareto.astype(bool)].sort_values(TIME)
    ax.plot(
        best[TIME], best[ERROR], color="#333333", linewidth=0.8,
        marker="o", markersize=7.5, markerfacecolor="none", markeredgewidth=0.8,
        drawstyle="steps-post", zorder=1,
    )  # fmt: skip
    if blind is not None:
        ax.axhline(np.clip(blind, LOW, HIGH), zorder=0, **_BLIND)
    if full_order is not None:
        ax.axvline(full_order, color=style.GREY, linewidth=1.2, zorder=0)
        time = np.append(time, full_order)
    low, high = np.log10(time.min()), np.log10(time.max())
    pad = max(0.1, 0.08 * (high - low))
    ax.set_xlim(10 ** (low - pad), 10 ** (high + pad))
    _draw_rates(ax)
    _label_times(ax, high - low)


def _label_iterations(ax: Axes, time: float, error: float, iterations: float) -> None:
    ax.annotate(
        f"{iterations:.0f}", (time, error), (0.0, 5.5), textcoords="offset points", fontsize=6.5,
        ha="center",
    )  # fmt: skip


def _draw_rates(ax: Axes) -> None:
    """Lines of real time; a rate that the axis does not reach is named at the side it lies on."""
    low, high = ax.get_xlim()
    limits = {rate: 1e3 / rate for rate in RATES}
    inside = [rate for rate in RATES if low < limits[rate] < high]
    heights = (0.98, 0.89, 0.8)
    for height, rate in zip(heights, inside, strict=False):
        ax.axvline(limits[rate], zorder=0, **_RATE)
        _label_rate(ax, limits[rate], height, f"{rate} fps ")
    beyond = [str(rate) for rate in RATES if limits[rate] >= high]
    if beyond:
        _label_rate(ax, high, heights[len(inside)], f"{', '.join(beyond)} fps \N{RIGHTWARDS ARROW}")


def _label_rate(ax: Axes, x: float, height: float, text: str) -> None:
    ax.text(
        x, height, text, transform=ax.get_xaxis_transform(), fontsize=6.5, va="top", ha="right",
        color="#6B675F",
    )  # fmt: skip


def _label_times(ax: Axes, decades: float) -> None:
    """Plain numbers on the logarithmic axis, as many as there is room for."""
    steps = [(0.4, (1, 1.5, 2, 3, 5, 7)), (0.7, (1, 2, 3, 5)), (1.3, (1, 2, 5)), (2.0, (1, 3))]
    subs = next((s for limit, s in steps if decades < limit), (1,))
    ax.xaxis.set_major_locator(LogLocator(subs=subs))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _legend(figure: Figure, results: Results, styles: dict[str, tuple[str, str]]) -> None:
    handles = [
        Line2D(
            [], [], linestyle="none", color=colour, marker=marker,
            label=results.method_title(method),
        )
        for method, (colour, marker) in styles.items()
    ]  # fmt: skip
    ring = {"marker": "o", "markersize": 7, "markerfacecolor": "none"}
    handles.append(Line2D([], [], label="fewer iterations (number K)", markersize=4.5, **_FEWER))
    handles.append(Line2D([], [], color="#333333", label="best trade-offs", **ring))
    handles.append(Line2D([], [], color=style.GREY, linewidth=1.2, label="full order: time"))
    handles.append(Line2D([], [], label="full order: its own error", **_BLIND))
    times = ", ".join(f"{1e3 / rate:.1f} ms" for rate in RATES)
    handles.append(Line2D([], [], label=f"real time ({times})", **_RATE))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
