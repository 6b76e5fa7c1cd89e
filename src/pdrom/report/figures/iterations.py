"""Error of the full-order run against its number of iterations, plain and accelerated."""

import pandas as pd

from pdrom.artifact.reads import TableOf
from pdrom.experiments.kit.names import ANDERSON, FOM
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Axes, Figure
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.multiples import (
    clipped,
    label_counts,
    label_outer,
    log_axis,
    no_minor_labels,
    small_multiples,
)
from pdrom.report.figures.kit.options import Columns, Scenes
from pdrom.report.figures.kit.results import Results

ERROR, TIME = "relative_error_within_horizon", "ms_per_frame"
LOW, HIGH = 1e-5, 1e1
RUNS = {
    FOM: ("plain iterations", style.BLACK, "o"),
    ANDERSON: ("with Anderson acceleration", style.VERMILLION, "s"),
}


class Options(Scenes, Columns):
    """Choices."""


@figure(
    title="What an iteration buys",
    caption=(
        "Error of the full-order run within the horizon against the same run with every frame "
        "solved to convergence, over the time of a frame. Dots are the numbers of local/global "
        "iterations, printed at the plain ones; accelerated runs combine the last iterates so "
        "that their combined residual is smallest, and have the same fixed point."
    ),
    reads=(TableOf("accuracy_cost"),),
    options=Options,
)
def iterations(results: Results, options: Options) -> Figure:
    """Draw a panel per scene: error to the converged run over the time of a frame, a dot per K."""
    table = results.table("accuracy_cost").dropna(subset=[ERROR, TIME])
    table = table[table.method.isin(list(RUNS))]
    scenes = results.scenes_of(table, options, "no full-order run with both an error and a time")
    figure, axes = small_multiples(len(scenes), options.columns, height=1.6)
    for ax, scene in zip(axes, scenes, strict=True):
        log_axis(ax, LOW, HIGH)
        ax.set_xscale("log")
        no_minor_labels(ax)
        for method in RUNS:
            rows = table[(table.scene == scene) & (table.method == method)]
            _draw_run(ax, rows.sort_values("iterations"), method)
        plain = table[(table.scene == scene) & (table.method == FOM)].sort_values("iterations")
        low, high = ax.get_xlim()
        ax.set_xlim(0.5 * low, high)
        label_counts(
            ax,
            plain[TIME],
            clipped(plain[ERROR].to_numpy(float), LOW, HIGH),
            counts=plain.iterations,
        )
        ax.set_title(style.words(scene))
    label_outer(axes, options.columns, "time per frame (ms)", y="error against K \N{INFINITY}")
    looks = {label: (colour, marker) for label, colour, marker in RUNS.values()}
    style.legend(figure, style.handles(looks), len(looks))
    return figure


def _draw_run(ax: Axes, rows: pd.DataFrame, method: str) -> None:
    _, colour, marker = RUNS[method]
    error = clipped(rows[ERROR].to_numpy(float), LOW, HIGH)
    ax.plot(rows[TIME], error, color=colour, marker=marker, markersize=3.2)
