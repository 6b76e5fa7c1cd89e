"""Small multiples: one panel per experiment, equal axes, one legend."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from pdrom.report.figures.kit import style

PANEL_HEIGHT = 1.45  # inches


def small_multiples(
    count: int, columns: int, legend_rows: int = 1, height: float = PANEL_HEIGHT
) -> tuple[Figure, list[Axes]]:
    """Figure with ``count`` panels that share the y axis; no empty panel is left over."""
    columns = min(columns, count)
    rows = -(-count // columns)
    size = (style.WIDTH, rows * height + 0.2 * legend_rows + 0.35)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
    for ax in axes[count:]:
        ax.remove()
    for i, ax in enumerate(axes[:count]):
        ax.tick_params(labelleft=i % columns == 0)
    return figure, list(axes[:count])


def label_outer(axes: list[Axes], columns: int, x: str, y: str) -> None:
    """Axis labels on the left and on the lowest panel of each column."""
    columns = min(columns, len(axes))
    for i, ax in enumerate(axes):
        if i % columns == 0:
            ax.set_ylabel(y)
        if i + columns >= len(axes):
            ax.set_xlabel(x)


def log_axis(ax: Axes, low: float, high: float) -> None:
    """Logarithmic y axis from ``low`` to ``high`` with few ticks."""
    ax.set_yscale("log")
    ax.set_ylim(low, high)
    ax.yaxis.set_major_locator(LogLocator(base=10.0, numticks=6))
    style.grid(ax)


def clipped(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Values moved to the nearest limit; NaN stays NaN."""
    return np.clip(values, low, high)
