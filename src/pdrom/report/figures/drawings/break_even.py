"""Break-even of reduced local steps (claim C9)."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pdrom.report.figures.break_even import Options
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import label_outer, small_multiples
from pdrom.report.figures.kit.results import NothingToDraw, Results

COLUMNS = ["scene", "group", "method", "factor", "threads", "r", "ratio"]


def draw(results: Results, options: Options) -> Figure:
    """A panel per constraint group, a line per scene and method; above 1 the reduction costs more.

    Raises
    ------
    StorageError
        The table is missing or lacks a column.
    """
    table = results.table("breakeven", COLUMNS)
    pairs = results.experiments(options)
    table = table[[pair in pairs for pair in zip(table.scene, table.group, strict=True)]]
    methods = results.methods(options)
    table = table[table.method.isin(methods) & (table.factor == 1.0) & (table.threads == 1)]
    if table.empty:
        raise NothingToDraw("no reduced local step was timed")
    groups = [g for g in style.group_looks(results.holdings) if (table.group == g).any()]
    figure, axes = small_multiples(len(groups), options.columns, legend_rows=2, height=1.8)
    styles = style.method_styles([m for m in methods if (table.method == m).any()])
    for ax, group in zip(axes, groups, strict=True):
        _draw_group(ax, table[table.group == group], styles)
        ax.set_title(style.words(group))
    label_outer(axes, options.columns, "basis vectors r", "reduced over full local step")
    handles = [
        Line2D([], [], color=colour, marker=marker, label=results.method_title(method))
        for method, (colour, marker) in styles.items()
    ]
    handles.append(Line2D([], [], color=style.BLACK, linestyle="--", label="break-even"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _draw_group(ax: Axes, rows: pd.DataFrame, styles: dict[str, tuple[str, str]]) -> None:
    ax.set_yscale("log")
    style.grid(ax)
    ax.axhline(1.0, color=style.BLACK, linestyle="--", linewidth=1.0, zorder=1)
    for (_, method), curve in rows.groupby(["scene", "method"], sort=False):
        colour, marker = styles[str(method)]
        curve = curve.sort_values("r")
        ax.plot(
            curve.r, curve.ratio, color=colour, marker=marker, markersize=2.6, linewidth=0.8,
            alpha=0.75,
        )  # fmt: skip
    ax.set_xlim(left=0.0)
