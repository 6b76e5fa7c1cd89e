"""Reductions on bases of round-off: how many starts fail, by scene, method and size."""

from matplotlib.figure import Figure

from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.counts import draw_counts
from pdrom.report.figures.kit.noise_rows import NOISY, WRONG
from pdrom.report.figures.kit.options import Scenes
from pdrom.report.figures.kit.results import NothingToDraw, Results

COLUMNS = ["scene", "group", "noisy_axes", "method", "r", "rank", "relative_error"]


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
    cells = {
        (y, x): tuple(counts.loc[(*row, *column)])
        for y, row in enumerate(rows)
        for x, column in enumerate(columns)
        if (*row, *column) in counts.index
    }
    figure = Figure(figsize=(style.WIDTH, 0.25 * len(rows) + 1.0), layout="constrained")
    ax = figure.subplots()
    labels = [f"{style.words(scene)}, {NOISY[axes]}" for scene, axes in rows]
    draw_counts(ax, labels, [f"$r$ = {r}" for _, r in columns], cells)
    methods = [method for method, _ in columns]
    for method in dict.fromkeys(methods):
        places = [x for x, other in enumerate(methods) if other == method]
        x, title = sum(places) / len(places), results.method_title(method)
        ax.text(x, -0.7, title, ha="center", va="bottom", fontsize=8)
    ax.set_xlabel("number of modes")
    ax.set_ylabel("scene, round-off")
    return figure
