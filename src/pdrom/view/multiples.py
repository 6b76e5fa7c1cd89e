"""Figures of many small panels that share the y axis and a legend, and helpers for axes."""

from collections.abc import Iterable

import numpy as np

from pdrom.view import style
from pdrom.view.artists import Axes, Axis, Figure, SubFigure

PANEL_HEIGHT = 1.45  # inches
NEAR = 0.05  # markers closer in x than this fraction of the x axis share a label


def small_multiples(
    count: int, columns: int, legend_rows: int = 1, height: float = PANEL_HEIGHT
) -> tuple[Figure, list[Axes]]:
    """Create a figure with ``count`` panels in ``columns`` columns that share the y axis.

    A row of panels is ``height`` inches high; space for ``legend_rows`` lines of a legend is left.
    """
    rows = rows_of(count, columns)
    figure = style.new_figure(rows * height + 0.2 * legend_rows + 0.35)
    return figure, panels(figure, count, columns, sharey=True)


def rows_of(count: int, columns: int) -> int:
    """Number of rows that ``count`` panels need in ``columns`` columns."""
    return -(-count // min(columns, count))


def panels(
    figure: Figure | SubFigure, count: int, columns: int, sharey: bool = False
) -> list[Axes]:
    """Add ``count`` panels to ``figure`` row by row in ``columns``, the last row perhaps shorter.

    With ``sharey`` the panels share the y axis, whose numbers stand at the left only.
    """
    columns = min(columns, count)
    grid = figure.subplots(rows_of(count, columns), columns, squeeze=False, sharey=sharey)
    axes = list(grid.ravel())
    for ax in axes[count:]:
        ax.remove()
    if sharey:
        for i, ax in enumerate(axes[:count]):
            ax.tick_params(labelleft=i % columns == 0)
    return axes[:count]


def label_outer(axes: list[Axes], columns: int, x: str, y: str) -> None:
    """Write label ``y`` on the leftmost of ``axes`` and ``x`` on the lowest of each column."""
    columns = min(columns, len(axes))
    for i, ax in enumerate(axes):
        if i % columns == 0:
            ax.set_ylabel(y)
        if i + columns >= len(axes):
            ax.set_xlabel(x)


def log_axis(ax: Axes, low: float, high: float) -> None:
    """Make y of ``ax`` logarithmic from ``low`` to ``high`` with few ticks."""
    from matplotlib.ticker import LogLocator

    ax.set_yscale("log")
    ax.set_ylim(low, high)
    ax.yaxis.set_major_locator(LogLocator(base=10.0, numticks=6))
    style.grid(ax)


def log_axes(ax: Axes, across: tuple[float, float], along: tuple[float, float]) -> None:
    """Make ``ax`` logarithmic with limits ``across`` in x and ``along`` in y."""
    log_axis(ax, *along)
    ax.set_xscale("log")
    ax.set_xlim(*across)


def time_axis(ax: Axes, times: np.ndarray) -> None:
    """Make x of ``ax`` logarithmic, with limits around ``times`` and plain labels, such as 20."""
    ax.set_xscale("log")
    low, high = np.log10(np.nanmin(times)), np.log10(np.nanmax(times))
    pad = max(0.1, 0.08 * (high - low))
    ax.set_xlim(10 ** (low - pad), 10 ** (high + pad))
    plain_ticks(ax.xaxis, high - low)


def plain_ticks(axis: Axis, decades: float) -> None:
    """Label two or more ticks of a log ``axis``, ``decades`` long, by numbers, not powers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    steps = [(0.4, (1, 1.5, 2, 3, 5, 7)), (0.7, (1, 2, 3, 5)), (1.3, (1, 2, 5)), (2.0, (1, 3))]
    subs = next((s for limit, s in steps if decades < limit), (1,))
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


ARROWS = {"left": 4, "right": 5, "up": 6, "down": 7}  # Matplotlib's numbers of arrow markers


def rim_arrows(
    ax: Axes,
    x: np.ndarray,
    y: np.ndarray,
    colour: str,
    across: tuple[float, float],
    along: tuple[float, float],
) -> None:
    """Draw arrows on the border of ``ax`` for points outside its limits.

    The limits are ``across`` in x and ``along`` in y, arrays ``x``, ``y`` (n,) the coordinates of
    the points, ``colour`` that of the arrows.
    """
    inside_x, inside_y = clipped(x, *across), clipped(y, *along)
    outside = {
        "left": x < across[0],
        "right": x > across[1],
        "up": y > along[1],
        "down": y < along[0],
    }
    for side, beyond in outside.items():
        if beyond.any():
            ax.plot(
                inside_x[beyond], inside_y[beyond], linestyle="none", color=colour, alpha=0.8,
                marker=ARROWS[side], markersize=5.0, markeredgewidth=0.0, clip_on=False,
            )  # fmt: skip


def clipped(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return ``values`` (n,) limited to the interval [``low``, ``high``]; NaN stays NaN."""
    return np.clip(values, low, high)


def label_counts(
    ax: Axes, x: Iterable[float], y: Iterable[float], counts: Iterable[float], prefix: str = ""
) -> None:
    """Label each marker at ``x``, ``y`` with its number in ``counts``, to the lower left of it.

    Markers closer than `NEAR` share one label. A label is ``prefix`` and the number or numbers.

    x : ascending; the limits of the x axis, which is logarithmic, must have been set before
    """
    low, high = np.log10(ax.get_xlim())
    groups: list[list[tuple[float, float, float]]] = []
    for marker in zip(x, y, counts, strict=True):
        near = groups and np.log10(marker[0] / groups[-1][-1][0]) < NEAR * (high - low)
        groups[-1].append(marker) if near else groups.append([marker])
    for group in groups:
        numbers = ", ".join(f"{count:.0f}" for _, _, count in group)
        ax.annotate(
            prefix + numbers, (group[0][0], min(height for _, height, _ in group)), (-2.5, -3.5),
            textcoords="offset points", fontsize=6.5, ha="right", va="top",
        )  # fmt: skip
