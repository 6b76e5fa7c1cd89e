"""Lay out figures of many small panels that share a y axis and a legend; label axes."""

from collections.abc import Sequence

import numpy as np

from pdrom.view import style
from pdrom.view.artists import Axes, Axis, Figure

PANEL_HEIGHT = 1.45  # inches


def small_multiples(
    count: int, columns: int, legend_rows: int = 1, height: float = PANEL_HEIGHT
) -> tuple[Figure, list[Axes]]:
    """Make ``count`` panels that share the y axis, with space for ``legend_rows`` lines below."""
    rows = rows_of(count, columns)
    figure = style.new_figure(rows * height + 0.2 * legend_rows + 0.35)
    return figure, panels(figure, count, columns, sharey=True)


def rows_of(count: int, columns: int) -> int:
    """Return the number of rows that ``count`` panels need in ``columns`` columns."""
    return -(-count // min(columns, count))


def panels(figure: Figure, count: int, columns: int, sharey: bool = False) -> list[Axes]:
    """Add ``count`` panels to ``figure``, row by row, in ``columns`` columns."""
    columns = min(columns, count)
    grid = figure.subplots(rows_of(count, columns), columns, squeeze=False, sharey=sharey)
    axes = list(grid.ravel())
    for ax in axes[count:]:
        ax.remove()
    return axes[:count]


def label_outer(axes: list[Axes], columns: int, x: str, y: str) -> None:
    """Write label ``y`` on the leftmost of ``axes`` and ``x`` on the lowest of each column."""
    columns = min(columns, len(axes))
    for i, ax in enumerate(axes):
        if i % columns == 0:
            ax.set_ylabel(y)
        if i + columns >= len(axes):
            ax.set_xlabel(x)


def label_rows(ax: Axes, names: Sequence[str]) -> None:
    """Label the rows of ``ax`` at y = 0, 1, 2, ..., from the top."""
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.tick_params(axis="y", length=0)


def time_axis(ax: Axes, times: np.ndarray) -> None:
    """Make the x axis logarithmic, with limits around ``times`` and plain labels such as 20."""
    ax.set_xscale("log")
    low, high = np.log10(np.nanmin(times)), np.log10(np.nanmax(times))
    pad = max(0.1, 0.08 * (high - low))
    ax.set_xlim(10 ** (low - pad), 10 ** (high + pad))
    plain_ticks(ax.xaxis, high - low)


def plain_ticks(axis: Axis, decades: float) -> None:
    """Label at least two ticks of a log ``axis`` of ``decades`` decades by plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    steps = [(0.4, (1, 1.5, 2, 3, 5, 7)), (0.7, (1, 2, 3, 5)), (1.3, (1, 2, 5)), (2.0, (1, 3))]
    subs = next((s for limit, s in steps if decades < limit), (1,))
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
