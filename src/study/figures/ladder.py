"""The ladder: choices that break the reduction, and by how much."""

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.multiples import clipped
from pdrom.view.text import plain_words
from study.artifact.reads import TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import NothingToDraw, Scenes

ERRORS, GAINS = (1e-4, 1e2), (1.0, 1e5)  # limits of the axes; points outside are drawn on the rim


@figure(
    title="One choice after the other",
    caption=(
        "Above the line one ingredient after the other is changed, from the published code to "
        "whole elements with oversampling; below it each row takes a single ingredient away from "
        "the complete method or exchanges it. Left the error of the rerun within the horizon, "
        "right the gain of the interpolation; what blew up or is singular lies on the right rim. "
        "Bars show the range over runs that are trained on as many resampled frames, on some "
        "scenes; pale ones that over choices of the arbitrary signs of the singular vectors."
    ),
    reads={"table": TableOf("ladder")},
    options=Scenes,
)
def ladder(options: Scenes, table: pd.DataFrame) -> Figure:
    """Draw rungs from top (published) to bottom; left the error of the rerun, right the gain.

    Below the line each row lacks one ingredient of the sound method. A bar shows the range over
    other training frames, a broad pale one that over choices of the singular vectors' signs for the
    published method. Runs that blew up before their horizon, and singular interpolations, lie on
    the right rim.
    """
    table = options.rows(table)
    table = table[table.gain.notna() & (table.direction != "square")]
    if table.empty:
        raise NothingToDraw("no scene that climbs the ladder")
    climbed = table[table.direction.isin(["up", "down"])]
    rungs = list(dict.fromkeys(zip(climbed.direction, climbed.rung, strict=True)))
    scenes = list(dict.fromkeys(table.scene))
    figure = style.new_figure(0.2 * len(rungs) + 1.2)
    left, right = figure.subplots(1, 2, sharey=True)
    error = ("relative_error_within_horizon", "error_low", "error_high")
    _draw_quantity(left, table, rungs, scenes, error, ERRORS)
    _draw_quantity(right, table, rungs, scenes, ("gain", "gain_low", "gain_high"), GAINS)
    left.set_xlabel("error of the rerun within the horizon (relative)")
    right.set_xlabel("gain of the interpolation")
    left.set_yticks(range(len(rungs)), [plain_words(rung) for _, rung in rungs])
    left.invert_yaxis()
    handles = style.scene_handles(scenes)
    handles.append(style.handle("range: training frames", color=style.GREY, linewidth=0.9))
    handles.append(style.handle("range: signs", color=style.GREY, linewidth=3.0, alpha=0.35))
    style.legend(figure, handles, 4)
    return figure


def _draw_quantity(
    ax: Axes,
    table: pd.DataFrame,
    rungs: list[tuple[str, str]],
    scenes: list[str],
    columns: tuple[str, str, str],
    limits: tuple[float, float],
) -> None:
    ax.set_xscale("log")
    ax.set_xlim(limits[0], limits[1] * 1.3)
    style.grid(ax)
    for i, scene in enumerate(scenes):
        rows = table[table.scene == scene].set_index(["direction", "rung"])
        found, low, high = (
            np.array([rows[column].get(rung, np.nan) for rung in rungs], float)
            for column in columns
        )
        values = clipped(np.nan_to_num(found, nan=np.inf), *limits)
        heights = np.arange(len(rungs)) + 0.09 * (i - 0.5 * (len(scenes) - 1))
        colour, marker = style.scene_style(i)
        ax.plot(values, heights, linestyle="none", color=colour, marker=marker, markersize=3.2)
        repeated = ~np.isnan(low)
        ends = (clipped(bound[repeated], *limits) for bound in (low, high))
        ax.hlines(heights[repeated], *ends, color=colour, linewidth=0.9)
        signs = table[(table.scene == scene) & (table.direction == "signs")][columns[0]]
        if len(signs):
            spread = clipped(np.nan_to_num(signs.to_numpy(float), nan=np.inf), *limits)
            ax.hlines(
                heights[0], spread.min(), spread.max(), color=colour, linewidth=3.0, alpha=0.25
            )
    first_down = next((i for i, (d, _) in enumerate(rungs) if d == "down"), len(rungs))
    ax.axhline(first_down - 0.5, color="#333333", linewidth=0.8)
