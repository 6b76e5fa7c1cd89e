"""What an iteration of the full-order run buys, plain and accelerated."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from pdrom.experiments.kit.names import ANDERSON, FOM
from pdrom.report.figures.iterations import Options
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import (
    clipped,
    label_counts,
    label_outer,
    log_axis,
    small_multiples,
)
from pdrom.report.figures.kit.results import NothingToDraw, Results

ERROR, TIME = "relative_error_within_horizon", "ms_per_frame"
COLUMNS = ["scene", "method", "iterations", ERROR, TIME]
LOW, HIGH = 1e-5, 1e1
RUNS = {
    FOM: ("plain iterations", style.BLACK, "o"),
    ANDERSON: ("with Anderson acceleration", style.VERMILLION, "s"),
}


def draw(results: Results, options: Options) -> Figure:
    """A panel per scene, error against the converged run over the time of a frame; dots are K.

    Raises
    ------
    StorageError
        The table is missing or lacks a column.
    """
    table = results.table("accuracy_cost", COLUMNS).dropna(subset=[ERROR, TIME])
    table = table[table.method.isin(list(RUNS))]
    held = results.scenes(options)
    scenes = [scene for scene in held if (table.scene == scene).any()]
    if not scenes:
        raise NothingToDraw("no full-order run with both an error and a time")
    figure, axes = small_multiples(len(scenes), options.columns, height=1.6)
    for ax, scene in zip(axes, scenes, strict=True):
        log_axis(ax, LOW, HIGH)
        ax.set_xscale("log")
        ax.xaxis.set_minor_formatter(NullFormatter())
        for method in RUNS:
            rows = table[(table.scene == scene) & (table.method == method)]
            _draw_run(ax, rows.sort_values("iterations"), method)
        plain = table[(table.scene == scene) & (table.method == FOM)].sort_values("iterations")
        low, high = ax.get_xlim()
        ax.set_xlim(0.5 * low, high)
        label_counts(
            ax, plain[TIME], clipped(plain[ERROR].to_numpy(float), LOW, HIGH), plain.iterations
        )
        ax.set_title(style.words(scene))
    label_outer(axes, options.columns, "time per frame (ms)", "error against K \N{INFINITY}")
    handles = [
        Line2D([], [], color=colour, marker=marker, label=label)
        for label, colour, marker in RUNS.values()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def _draw_run(ax: Axes, rows: pd.DataFrame, method: str) -> None:
    _, colour, marker = RUNS[method]
    error = clipped(rows[ERROR].to_numpy(float), LOW, HIGH)
    ax.plot(rows[TIME], error, color=colour, marker=marker, markersize=3.2)
