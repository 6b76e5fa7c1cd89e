"""Errors of a scene's reductions against the basis size."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import clipped, log_axis, small_multiples
from pdrom.report.figures.kit.results import NothingToDraw
from pdrom.report.scenes.picture import write_picture
from pdrom.report.scenes.results import SceneResults

LOW, HIGH = 1e-7, 1e3  # errors outside are drawn on the limit
SPLITS = ("train", "heldout")
CROSS: dict = {"linestyle": "none", "marker": "x", "markersize": 5, "markeredgewidth": 1.3}


def make(results: SceneResults, outputs: Mapping[str, str]) -> None:
    """Write the picture."""
    write_picture(draw, results, "errors against the basis size", outputs)


def draw(results: SceneResults) -> Figure:
    """For each group the error of the projections, and that of the run within the horizon.

    A run that blew up before the horizon is a cross on the upper rim. No line without points is
    drawn: the layout would make room for it.

    Raises
    ------
    StorageError
        A file of the results is missing or damaged.
    """
    if not results.reductions:
        raise NothingToDraw("the scene names no group to reduce (key reduce)")
    errors, runs = results.table("reconstruction_error"), results.runs()
    styles = style.method_styles(results.holdings.methods)
    figure, axes = small_multiples(2 * len(results.groups), 2, legend_rows=4, height=2.0)
    for i, group in enumerate(results.groups):
        left, right = axes[2 * i : 2 * i + 2]
        title = results.experiment_title(results.scene, group)
        for ax, what in ((left, "projections"), (right, "run, within the horizon")):
            log_axis(ax, LOW, HIGH)
            ax.set_title(f"{title}: {what}")
            ax.set_xlabel("basis size r")
            ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        left.set_ylabel("relative error")
        for method, look in styles.items():
            _draw_projections(left, _of(errors, group, method), look)
            _draw_runs(right, _of(runs, group, method), look)
    _legend(figure, results, styles)
    return figure


def _of(table: pd.DataFrame, group: str, method: str) -> pd.DataFrame:
    return table[(table.group == group) & (table.method == method)].sort_values("r")


def _draw_projections(ax: Axes, rows: pd.DataFrame, look: tuple[str, str]) -> None:
    for split in SPLITS:
        line = rows[(rows.split == split) & rows.relative_error.notna()]
        error = clipped(line.relative_error.to_numpy(float), LOW, HIGH)
        if len(line):
            ax.plot(line.r, error, color=look[0], linestyle=style.SPLITS[split], clip_on=False)


def _draw_runs(ax: Axes, rows: pd.DataFrame, look: tuple[str, str]) -> None:
    rows = rows[rows.frames > 0]
    error = rows.relative_error_within_horizon.to_numpy(float)
    judged = np.isfinite(error)
    shown = clipped(error[judged], LOW, HIGH)
    if judged.any():
        ax.plot(rows.r[judged], shown, color=look[0], marker=look[1], clip_on=False)
    failed = rows.r[~judged & rows.blowup_frame.notna().to_numpy()]
    if len(failed):
        rim = np.full(len(failed), HIGH)
        ax.plot(failed, rim, color=look[0], clip_on=False, zorder=6, **CROSS)


def _legend(figure: Figure, results: SceneResults, styles: dict[str, tuple[str, str]]) -> None:
    handles = [*style.method_handles(results, styles), *style.split_handles(SPLITS)]
    handles.append(style.handle("blew up before the horizon", color="#555555", **CROSS))
    style.legend(figure, handles, 3)
