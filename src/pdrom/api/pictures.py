"""Pictures of runs, and a page to look at them."""

import os
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from pdrom.api.arguments import file_path, require
from pdrom.api.records import FullRun, ReducedRun
from pdrom.core.errors import SceneError
from pdrom.core.store import require_own, require_place
from pdrom.reduction.rerun import displacement_norms
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import clipped, log_axis
from pdrom.report.viewer.page import write_page
from pdrom.report.viewer.runs import ViewedRun, ViewedScene

LOW, HIGH = 1e-7, 1e3  # errors outside are drawn on the limit


def plot(*runs: ReducedRun) -> Figure:
    """Errors of reduced runs against time; a cross ends a run that blew up.

    Parameters
    ----------
    runs : reduced runs, of one scene or of several; each gets a line and an entry of the legend

    Returns
    -------
    Figure
        Relative error of every frame over seconds; errors below 1e-7 or above 1e3 are drawn on
        these limits. ``plot(...).savefig("errors.png")`` writes the picture.

    Raises
    ------
    ConfigurationError, SceneError
        An argument is no reduced run; there is none.
    """
    if not runs:
        raise SceneError("plot: at least one run is required")
    for run in runs:
        require(ReducedRun, run, "plot", source="pdrom.api.reduce makes one, load reads one")
    with style.look():
        figure = style.new_figure(3.0)
        ax = figure.subplots()
        log_axis(ax, LOW, HIGH)
        for i, reduced in enumerate(runs):
            time = reduced.full.scene.config.time_step * np.arange(1, len(reduced.error) + 1)
            colour, shown = style.CYCLE[i % len(style.CYCLE)], clipped(reduced.error, LOW, HIGH)
            ax.plot(time, shown, color=colour, label=reduced.title)
            if not reduced.outcome.finite and len(time):
                ax.plot(time[-1:], shown[-1:], color=colour, marker="x", markersize=5)
        ax.set_xlim(0.0, None)
        ax.set_xlabel("time in s")
        ax.set_ylabel("relative error")
        ax.legend(loc="upper left")
    return figure


def view(path: str | os.PathLike[str], *runs: FullRun | ReducedRun) -> None:
    """Write a page (HTML, one file) that shows runs; a browser opens it without a network.

    Reduced runs are shown with their full-order run; runs with equal scenes become one scene.

    Parameters
    ----------
    path : file to write
    runs : full-order and reduced runs

    Raises
    ------
    ConfigurationError, SceneError, StorageError
        An argument is no run; none is given, or two scenes that differ have the same name; the page
        would be too large, or cannot be written.
    """
    require_place(file_path(path))
    require_own(path)
    write_page(viewed_scenes(*runs), path)


def viewed_scenes(*runs: FullRun | ReducedRun) -> list[ViewedScene]:
    """Scenes as pictures and pages show them, each with its runs; errors as `view` raises them.

    Parameters
    ----------
    runs : full-order and reduced runs; those with equal scenes become one scene
    """
    if not runs:
        raise SceneError("view: at least one run is required")
    for run in runs:
        require((FullRun, ReducedRun), run, "view", source="pdrom.api.run and reduce make one")
    scenes: dict[str, tuple[FullRun, list[ReducedRun]]] = {}
    for run in runs:
        full = run.full if isinstance(run, ReducedRun) else run
        name = full.scene.config.name
        known, reduced = scenes.setdefault(name, (full, []))
        if known.scene.config != full.scene.config:
            raise SceneError(f"view: two different scenes are called '{name}'")
        if isinstance(run, ReducedRun):
            reduced.append(run)
    return [_viewed(full, reduced) for full, reduced in scenes.values()]


def _viewed(full: FullRun, reduced: list[ReducedRun]) -> ViewedScene:
    config = full.scene.config
    ordered = sorted(reduced, key=lambda run: run.r)
    return ViewedScene(
        name=config.name,
        title=config.title,
        mesh=full.scene.mesh,
        time_step=config.time_step,
        positions=full.positions,
        ms=float(np.median(full.ms)),
        runs=tuple(
            ViewedRun(
                group=run.group,
                method=run.method,
                title=run.method,
                r=run.r,
                read=partial(np.asarray, run.outcome.positions),
                error=run.error,
                blowup_frame=run.outcome.blowup_frame,
                ms=run.ms if np.isfinite(run.ms) else None,
            )
            for run in ordered
        ),
        effects=config.effects,
        tables={"runs": partial(_table, ordered)},
    )


def _table(runs: list[ReducedRun]) -> pd.DataFrame:
    """A row of each run; errors are those of the whole run, as no horizon is known."""
    rows = [
        {
            "scene": run.full.scene.config.name,
            "group": run.group,
            "method": run.method,
            "position_basis": "full",
            "r": run.r,
            "frames": run.outcome.frames,
            "blowup_frame": run.outcome.blowup_frame,
            "relative_error_within_horizon": run.outcome.error(
                displacement_norms(run.full.positions)
            ),
            "ms_per_frame": run.ms,
            "gain": run.gain,
        }
        for run in runs
    ]
    return pd.DataFrame(rows)
