"""Time of an iteration against the number of vertices, for the full model and reduced ones."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import plain_ticks
from pdrom.report.figures.kit.options import Scenes
from pdrom.report.figures.kit.results import NothingToDraw, Results

COLUMNS = [
    "scene", "method", "threads", "vertices", "ms_per_iteration", "local_ms", "global_ms",
    "factorisation_ms", "memory_mb",
]  # fmt: skip
PHASES = {
    "ms_per_iteration": ("whole iteration", "-"),
    "local_ms": ("local step", "--"),
    "global_ms": ("global solve", ":"),
}
OFFLINE = {
    "factorisation_ms": ("factorisation (ms)", style.VERMILLION, "s"),
    "memory_mb": ("memory for it (MB)", style.PURPLE, "^"),
}
TWO = "two threads"  # a method of its own here: the full-order run with two threads
NAMES = {"fom": "full order", TWO: "full order, two threads", "ecsw": "POD subspace, ecsw"}
COLOURS = {"fom": style.BLACK, TWO: "#8C8C8C", "ecsw": "#1B6E6E"}
FITTED = ("fom", "ecsw")  # whose exponent is printed
ROOM = 2.6  # factor by which the axis goes on beyond the last mesh, for the exponents
MARKERS = {"fom": "o", TWO: "s", "ecsw": ">"}


def draw(results: Results, options: Scenes) -> Figure:
    """A column per scene: above the time of an iteration by phase, below what comes before it.

    Raises
    ------
    StorageError
        A table is missing or lacks a column.
    """
    table = _two_threads_apart(results.table("scaling", COLUMNS))
    fits = _two_threads_apart(results.table("scaling_fit"))
    asked = options.scenes or tuple(dict.fromkeys(table.scene))
    scenes = [scene for scene in asked if (table.scene == scene).any()]
    if not scenes:
        raise NothingToDraw("no mesh sizes")
    figure = Figure(figsize=(style.WIDTH, 4.6), layout="constrained")
    times, offline = figure.subplots(
        2, len(scenes), sharex=True, sharey="row", squeeze=False, height_ratios=(1.7, 1.0)
    )
    for ax, lower, scene in zip(times, offline, scenes, strict=True):
        rows = table[table.scene == scene].sort_values("vertices")
        _draw_times(ax, rows, fits[fits.scene == scene])
        _draw_offline(lower, rows[rows.method == "fom"])
        ax.set_title(style.words(scene))
        lower.set_xlabel("vertices")
    sizes = table[table.scene.isin(scenes)].vertices
    times[0].set_xlim(0.75 * sizes.min(), ROOM * sizes.max())
    for axis in (times[0].xaxis, times[0].yaxis, offline[0].yaxis):  # shared by all panels
        low, high = np.log10(axis.get_view_interval())
        plain_ticks(axis, high - low)
    times[0].set_ylabel("time of an iteration (ms)")
    offline[0].set_ylabel("before the first frame")
    _legend(figure, results, list(dict.fromkeys(table.method)))
    return figure


def _two_threads_apart(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(method=table.method.mask(table.threads == 2, TWO))


def _draw_times(ax: Axes, rows: pd.DataFrame, fits: pd.DataFrame) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    style.grid(ax)
    for method, part in rows.groupby("method", sort=False):
        colour, marker = _style(str(method))
        for quantity, (_, line) in PHASES.items():
            if (method, quantity) == (TWO, "global_ms"):
                continue  # the solves have one thread
            ax.plot(
                part.vertices, part[quantity], line, color=colour,
                marker=marker if line == "-" else None, linewidth=1.3 if line == "-" else 0.9,
            )  # fmt: skip
        own = (fits.method == method) & (fits.quantity == "ms_per_iteration")
        if own.any() and method in FITTED:
            end = part.iloc[-1]
            ax.annotate(
                rf"$N^{{{fits[own].exponent.iloc[0]:.2f}}}$",
                (end.vertices, end.ms_per_iteration), xytext=(5, 0),
                textcoords="offset points", va="center", color=colour, fontsize=7.5,
            )  # fmt: skip


def _draw_offline(ax: Axes, rows: pd.DataFrame) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    style.grid(ax)
    for quantity, (label, colour, marker) in OFFLINE.items():
        shown = rows[rows[quantity] > 0.0]
        ax.plot(shown.vertices, shown[quantity], color=colour, marker=marker, label=label)


def _style(method: str) -> tuple[str, str]:
    colour, marker = style.method_styles([method])[method]
    return COLOURS.get(method, colour), MARKERS.get(method, marker)


def _legend(figure: Figure, results: Results, methods: list[str]) -> None:
    handles = []
    for method in methods:
        colour, marker = _style(method)
        label = NAMES.get(method) or results.method_title(method)
        handles.append(Line2D([], [], color=colour, marker=marker, label=label))
    for label, line in PHASES.values():
        handles.append(Line2D([], [], color="#555555", linestyle=line, label=label))
    for label, colour, marker in OFFLINE.values():
        handles.append(Line2D([], [], color=colour, marker=marker, label=label))
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
