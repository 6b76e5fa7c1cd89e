"""A table of counts: cells that hold ``a of b``, coloured by their ratio."""

from collections.abc import Mapping, Sequence

import numpy as np

from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Axes

Cell = tuple[int, int]


def draw_counts(
    ax: Axes, rows: Sequence[str], columns: Sequence[str], cells: Mapping[tuple[int, int], Cell]
) -> None:
    """Draw on ``ax`` cells by (row, column): (a, b) with a of b; the more of them the darker."""
    from matplotlib.colors import LinearSegmentedColormap

    colours = LinearSegmentedColormap.from_list("counts", ["#FFFFFF", style.VERMILLION])
    share = np.full((len(rows), len(columns)), np.nan)
    for place, (some, whole) in cells.items():
        share[place] = some / whole
        y, x = place
        ax.text(x, y, f"{some} of {whole}", ha="center", va="center", fontsize=7)
    ax.imshow(share, cmap=colours, vmin=0.0, vmax=1.0, aspect="auto")
    ax.set_xticks(range(len(columns)), columns)
    ax.set_yticks(range(len(rows)), rows)
    ax.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    ax.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    ax.grid(False, which="major")
    ax.grid(True, which="minor", color=style.GREY, linewidth=0.5)
    ax.tick_params(which="both", length=0)
