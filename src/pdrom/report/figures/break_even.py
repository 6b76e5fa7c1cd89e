"""Break-even of reduced local steps (claim C9)."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pdrom.core.store import read_table
from pdrom.report.figures import style
from pdrom.report.figures.multiples import label_outer, small_multiples
from pdrom.report.figures.sources import Sources
from pdrom.report.figures.spec import FigureSpec

COLUMNS = ["scene", "group", "method", "factor", "threads", "r", "ratio"]


@style.styled
def draw(sources: Sources, spec: FigureSpec) -> Figure:
    """A panel per constraint group, a line per scene and method; above 1 the reduction costs more.

    Raises
    ------
    StorageError
        The table is missing or lacks a column.
    """
    table = read_table(sources.table("breakeven"), COLUMNS)
    pairs = sources.holdings.experiments(spec.scenes, spec.groups)
    table = table[[pair in pairs for pair in zip(table.scene, table.group, strict=True)]]
    methods = sources.holdings.methods(spec.methods)
    table = table[table.method.isin(methods) & (table.factor == 1.0) & (table.threads == 1)]
    if table.empty:
        return style.no_data("no reduced local step was timed")
    groups = [g for g in style.GROUPS if (table.group == g).any()]
    groups += sorted(set(table.group) - set(groups))
    figure, axes = small_multiples(len(groups), spec.columns, legend_rows=2, height=1.8)
    styles = style.method_styles([m for m in methods if (table.method == m).any()])
    for ax, group in zip(axes, groups, strict=True):
        _draw_group(ax, table[table.group == group], styles)
        ax.set_title(style.words(group))
    label_outer(axes, spec.columns, "basis vectors r", "reduced over full local step")
    handles = [
        Line2D([], [], color=colour, marker=marker, label=sources.holdings.title(method))
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
