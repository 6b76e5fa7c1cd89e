"""Reductions on bases of round-off: how many starts fail, by scene, method and size."""

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.options import Scenes
from pdrom.report.figures.kit.results import NothingToDraw, Results

COLUMNS = ["scene", "group", "noisy_axes", "method", "r", "rank", "relative_error"]
WRONG = 0.1  # of the motion
_MAP = LinearSegmentedColormap.from_list("failed", ["#FFFFFF", style.VERMILLION])
_AXES = {"all": "all axes", "plane": "in the plane"}


def draw(results: Results, options: Scenes) -> Figure:
    """A table of cells; StorageError if the table is missing or lacks a column."""
    table = results.table("noise", COLUMNS)
    if options.scenes:
        table = table[table.scene.isin(options.scenes)]
    table = table[table.r <= table["rank"]]
    if table.empty:
        raise NothingToDraw("no basis of round-off")
    failed = ~(table.relative_error <= WRONG)
    keys = [table.scene, table.noisy_axes, table.method, table.r]
    counts = failed.groupby(keys, sort=False).agg(["sum", "count"])
    rows = list(dict.fromkeys(zip(table.scene, table.noisy_axes, strict=True)))
    columns = sorted(dict.fromkeys(zip(table.method, table.r, strict=True)))
    figure = Figure(figsize=(style.WIDTH, 0.32 * len(rows) + 1.0), layout="constrained")
    ax = figure.subplots()
    share = np.full((len(rows), len(columns)), np.nan)
    for y, row in enumerate(rows):
        for x, column in enumerate(columns):
            if (*row, *column) in counts.index:
                bad, total = counts.loc[(*row, *column)]
                share[y, x] = bad / total
                ax.text(x, y, f"{bad} of {total}", ha="center", va="center", fontsize=7.5)
    ax.imshow(share, cmap=_MAP, vmin=0.0, vmax=1.0, aspect="auto")
    ax.set_xticks(
        range(len(columns)), [f"{results.method_title(m)}\n$r$ = {r}" for m, r in columns]
    )
    ax.set_yticks(range(len(rows)), [f"{style.words(s)}, {_AXES.get(a, a)}" for s, a in rows])
    ax.set_xlabel("method and number of modes")
    ax.set_ylabel("scene, round-off")
    ax.tick_params(length=0)
    ax.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    ax.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    ax.grid(True, which="minor", color=style.GREY, linewidth=0.5)
    ax.tick_params(which="minor", length=0)
    return figure
