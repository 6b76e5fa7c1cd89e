"""Errors of a scene's reduced runs against the basis size and against time."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import clipped, label_outer, log_axis, small_multiples
from pdrom.report.scenes.picture import shown, write_picture
from pdrom.report.viewer.runs import ViewedRun, ViewedScene
from pdrom.report.words.text import plain_words

LOW, HIGH = 1e-7, 1e3  # errors outside are drawn on the limit
SPLITS = ("train", "heldout")
CROSS: dict = {"linestyle": "none", "marker": "x", "markersize": 5, "markeredgewidth": 1.3}
FLOOR, HORIZON = "#DDD9D0", {"color": "#8A857A", "linewidth": 0.8, "linestyle": (0, (1, 1.5))}
SMALL, LARGE = "--", "-"  # lines of the size that pictures show and of the largest one
PROJECTIONS = "reconstruction_error"  # table, known of the pipeline's results


def error_against_r(scene: ViewedScene, pdf: Path, png: Path) -> None:
    """Write the picture of ``scene`` to ``pdf`` and ``png``."""
    write_picture(_draw_against_r, scene, "errors against the basis size", pdf=pdf, png=png)


def error_against_time(scene: ViewedScene, pdf: Path, png: Path) -> None:
    """Write the picture of ``scene`` to ``pdf`` and ``png``."""
    write_picture(_draw_against_time, scene, "error against time", pdf=pdf, png=png)


def _draw_against_r(scene: ViewedScene) -> Figure:
    """For each group the error of the run within the horizon, and that of the projections.

    Of own runs no horizon is known, and no error of the projections. A run that blew up before the
    horizon is a cross on the upper rim. No line without points is drawn: the layout would make room
    for it.
    """
    if not scene.runs:
        return _nothing(scene)
    horizon = ", within the horizon" if len(scene.floor) else ""
    drawn = {f"run{horizon}": (scene.tables["runs"](), _draw_runs)}
    if PROJECTIONS in scene.tables:
        drawn = {"projections": (scene.tables[PROJECTIONS](), _draw_projections), **drawn}
    figure, axes = small_multiples(len(drawn) * len(scene.groups), 2, legend_rows=4, height=2.0)
    panels = [(group, what) for group in scene.groups for what in drawn]
    for ax, (group, what) in zip(axes, panels, strict=True):
        log_axis(ax, LOW, HIGH)
        ax.set_title(f"{style.words(group)}: {what}")
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        table, draw = drawn[what]
        for method, look in _looks(scene).items():
            rows = table[(table.group == group) & (table.method == method)]
            draw(ax, rows.sort_values("r"), look)
    label_outer(axes, 2, "basis size r", y="relative error")
    handles = _methods(scene, marked=True)
    if PROJECTIONS in scene.tables:
        handles += [
            _line(style.SPLIT_NAMES[split], linestyle=style.SPLITS[split]) for split in SPLITS
        ]
    handles.append(_line("blew up before the horizon" if horizon else "blew up", **CROSS))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _draw_projections(ax: Axes, rows: pd.DataFrame, look: tuple[str, str]) -> None:
    for split in SPLITS:
        line = rows[(rows.split == split) & rows.relative_error.notna()]
        error = clipped(line.relative_error.to_numpy(float), LOW, HIGH)
        if len(line):
            ax.plot(line.r, error, color=look[0], linestyle=style.SPLITS[split], clip_on=False)


def _draw_runs(ax: Axes, rows: pd.DataFrame, look: tuple[str, str]) -> None:
    rows = rows[(rows.frames > 0) & (rows.position_basis == "full")]
    error = rows.relative_error_within_horizon.to_numpy(float)
    judged = np.isfinite(error)
    if judged.any():
        inside = clipped(error[judged], LOW, HIGH)
        ax.plot(rows.r[judged], inside, color=look[0], marker=look[1], clip_on=False)
    failed = rows.r[~judged & rows.blowup_frame.notna().to_numpy()]
    if len(failed):
        rim = np.full(len(failed), HIGH)
        ax.plot(failed, rim, color=look[0], clip_on=False, zorder=6, **CROSS)


def _draw_against_time(scene: ViewedScene) -> Figure:
    """A panel per group, two sizes of each method, the floor and the horizon behind them."""
    if not scene.runs:
        return _nothing(scene)
    figure, axes = small_multiples(len(scene.groups), 2, legend_rows=3, height=2.0)
    for ax, group in zip(axes, scene.groups, strict=True):
        log_axis(ax, LOW, HIGH)
        ax.set_title(style.words(group))
        if len(scene.floor):
            floor = clipped(scene.floor, LOW, HIGH)
            ax.fill_between(np.arange(len(floor)), LOW, floor, color=FLOOR, linewidth=0, zorder=0)
        if scene.horizon is not None:
            ax.axvline(scene.horizon, zorder=1, **HORIZON)
        for method, look in _looks(scene).items():
            sizes = scene.sizes(group, method)
            for run, line in {r.r: (r, s) for r, s in _two(sizes)}.values():
                _draw_error(ax, run, look[0], line)
        ax.set_xlim(0, None)
    label_outer(axes, 2, "frame", y="relative error")
    handles = _methods(scene)
    handles += [_line("largest size", linestyle=LARGE), _line("r = 20 or below", linestyle=SMALL)]
    handles.append(_line("blew up", **CROSS))
    if len(scene.floor):
        handles.append(Patch(color=FLOOR, label="sensitivity floor"))
        handles.append(Line2D([], [], label="horizon", **HORIZON))
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _two(sizes: list[ViewedRun]) -> list[tuple[ViewedRun, str]]:
    return [(shown(sizes), SMALL), (sizes[-1], LARGE)] if sizes else []


def _draw_error(ax: Axes, run: ViewedRun, colour: str, line: str) -> None:
    frames = np.arange(1, len(run.error) + 1)
    inside = clipped(np.where(np.isfinite(run.error), run.error, HIGH), LOW, HIGH)
    ax.plot(frames, inside, color=colour, linestyle=line, linewidth=1.0)
    if run.blowup_frame is not None and len(frames):
        ax.plot(frames[-1:], inside[-1:], color=colour, clip_on=False, zorder=6, **CROSS)


def _looks(scene: ViewedScene) -> dict[str, tuple[str, str]]:
    return style.method_styles(dict.fromkeys(run.method for run in scene.runs))


def _methods(scene: ViewedScene, marked: bool = False) -> list:
    titles = {run.method: plain_words(run.title) for run in scene.runs}
    return [
        Line2D([], [], color=colour, marker=marker if marked else "", label=titles[method])
        for method, (colour, marker) in _looks(scene).items()
    ]


def _line(label: str, **look: object) -> Line2D:
    return Line2D([], [], label=label, **{"color": "#555555", **look})


def _nothing(scene: ViewedScene) -> Figure:
    return style.note(f"{scene.name}: no reduced run")
