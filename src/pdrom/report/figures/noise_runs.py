"""Reductions of projections that are round-off, on bases of that noise."""

from pdrom.artifact.reads import TableOf
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Figure
from pdrom.report.figures.kit.counts import draw_counts
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.noise_rows import NOISY, WRONG
from pdrom.report.figures.kit.options import Scenes
from pdrom.report.figures.kit.results import NothingToDraw, Results


@figure(
    title="Reductions on bases of round-off",
    caption=(
        "Groups whose projections are round-off, reduced on bases of it, without a cutoff. Each "
        "cell holds the starts, each with another round-off, of which the run fails (it does not "
        "start, or misses by more than a tenth of the motion), of all starts; columns are methods "
        "and sizes, rows are scenes with the axes that the round-off of the start reaches. Where "
        "it leaves out the axis across the sheet, and nothing else moves the sheet there, the "
        "joint selection's separate system of that axis is exactly singular; where it moves a "
        "single vertex across the sheet, this hangs on the vertex and on the size."
    ),
    reads=(TableOf("noise"),),
    options=Scenes,
)
def noise_runs(results: Results, options: Scenes) -> Figure:
    """Draw a table of cells."""
    table = results.asked_rows("noise", options)
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
    figure = style.new_figure(0.25 * len(rows) + 1.0)
    ax = figure.subplots()
    labels = [f"{style.words(scene)}, {NOISY[axes]}" for scene, axes in rows]
    draw_counts(ax, labels, [f"$r$ = {r}" for _, r in columns], cells=cells)
    methods = [method for method, _ in columns]
    for method in dict.fromkeys(methods):
        places = [x for x, other in enumerate(methods) if other == method]
        x, title = sum(places) / len(places), results.method_title(method)
        ax.text(x, -0.7, title, ha="center", va="bottom", fontsize=8)
    ax.set_xlabel("number of modes")
    ax.set_ylabel("scene, round-off")
    return figure
