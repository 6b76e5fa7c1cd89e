"""Accuracy of reduced models against their time per frame."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from pdrom.figures import style
from pdrom.figures.multiples import clipped, label_outer, log_axis, small_multiples
from pdrom.figures.sources import Sources
from pdrom.figures.spec import FigureSpec
from pdrom.store import read_table

COLUMNS = [
    "scene", "method", "position_basis", "relative_error_within_horizon", "ms_per_frame", "pareto",
]  # fmt: skip
LOW, HIGH = 1e-6, 1e2  # errors outside are drawn on the limit
RATES = (60, 30)  # frames per second


@style.styled
def draw(sources: Sources, spec: FigureSpec) -> Figure:
    """A panel per scene, a dot per reduced model; the best trade-offs are joined and ringed.

    Errors outside the axis lie on its rim. A vertical line marks the compiled full-order run.

    Raises
    ------
    StorageError
        The table is missing or lacks a column.
    """
    table = read_table(sources.table("accuracy_cost"), COLUMNS)
    table = table.dropna(subset=["relative_error_within_horizon", "ms_per_frame"])
    own = (table.method == "full") & (table.position_basis == "full")
    full_order = table[own].set_index("scene").ms_per_frame
    table = table[(table.relative_error_within_horizon > 0.0) & (table.ms_per_frame > 0.0) & ~own]
    table["method"] = [_name(row) for row in table.itertuples()]
    if spec.methods:
        table = table[table.method.isin(spec.methods)]
    held = list(dict.fromkeys(s for s, _ in sources.holdings.experiments(spec.scenes)))
    scenes = [scene for scene in held if (table.scene == scene).any()]
    if not scenes:
        return style.no_data("no reduced model with both an error and a time")
    figure, axes = small_multiples(len(scenes), spec.columns, legend_rows=4, height=1.8)
    table = table[table.scene.isin(scenes)]
    methods = list(dict.fromkeys(table.method))
    styles = style.method_styles(methods)
    for ax, scene in zip(axes, scenes, strict=True):
        _draw_scene(ax, table[table.scene == scene], styles, full_order.get(scene))
        ax.set_title(style.words(scene))
    label_outer(axes, spec.columns, "time per frame (ms)", "relative error")
    _legend(figure, sources, styles)
    return figure


def _name(row) -> str:
    """Method of a row; in a position subspace its kind comes first."""
    if row.position_basis == "full":
        return str(row.method)
    subspace = f"{row.position_basis} subspace"
    return subspace if row.method == "full" else f"{subspace}, {row.method}"


def _draw_scene(
    ax: Axes, rows: pd.DataFrame, styles: dict[str, tuple[str, str]], full_order: float | None
) -> None:
    ax.set_xscale("log")
    log_axis(ax, LOW, HIGH)
    error = clipped(rows.relative_error_within_horizon.to_numpy(float), LOW, HIGH)
    rows = rows.assign(relative_error_within_horizon=error)
    time = rows.ms_per_frame.to_numpy(float)
    for method, part in rows.groupby("method", sort=False):
        colour, marker = styles[str(method)]
        ax.plot(
            part.ms_per_frame, part.relative_error_within_horizon, linestyle="none",
            color=colour, marker=marker, markersize=3.8, alpha=0.85,
        )  # fmt: skip
    best = rows[rows.pareto.astype(bool)].sort_values("ms_per_frame")
    ax.plot(
        best.ms_per_frame, best.relative_error_within_horizon, color="#333333", linewidth=0.8,
        marker="o", markersize=7.5, markerfacecolor="none", markeredgewidth=0.8,
        drawstyle="steps-post", zorder=1,
    )  # fmt: skip
    for height, rate in zip((0.98, 0.89), RATES, strict=True):
        limit = 1e3 / rate
        if 0.3 * time.min() < limit < 3.0 * time.max():
            ax.axvline(limit, color="#8A857A", linewidth=0.8, linestyle="--", zorder=0)
            ax.text(
                limit, height, f"{rate} fps ", transform=ax.get_xaxis_transform(), fontsize=7,
                va="top", ha="right", color="#6B675F",
            )  # fmt: skip
    if full_order is not None:
        ax.axvline(full_order, color=style.GREY, linewidth=1.2, zorder=0)
        time = np.append(time, full_order)
    low, high = np.log10(time.min()), np.log10(time.max())
    pad = max(0.1, 0.08 * (high - low))
    ax.set_xlim(10 ** (low - pad), 10 ** (high + pad))
    _label_times(ax, high - low)


def _label_times(ax: Axes, decades: float) -> None:
    """Plain numbers on the logarithmic axis, as many as there is room for."""
    steps = [(0.4, (1, 1.5, 2, 3, 5, 7)), (0.7, (1, 2, 3, 5)), (1.3, (1, 2, 5)), (9, (1,))]
    subs = next((s for limit, s in steps if decades < limit), (1,))
    ax.xaxis.set_major_locator(LogLocator(subs=subs))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _legend(figure: Figure, sources: Sources, styles: dict[str, tuple[str, str]]) -> None:
    handles = [
        Line2D(
            [], [], linestyle="none", color=colour, marker=marker,
            label=sources.holdings.title(method),
        )
        for method, (colour, marker) in styles.items()
    ]  # fmt: skip
    ring = {"marker": "o", "markersize": 7, "markerfacecolor": "none"}
    handles.append(Line2D([], [], color="#333333", label="best trade-offs", **ring))
    handles.append(Line2D([], [], color=style.GREY, linewidth=1.2, label="full order"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
