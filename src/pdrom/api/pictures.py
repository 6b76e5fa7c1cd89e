"""Plots of errors, and HTML pages that show runs."""

import os
from typing import get_args

import numpy as np

from pdrom.api.files import file_path, require_run
from pdrom.api.records import AnyRun, ReducedRun
from pdrom.core.errors import SceneError
from pdrom.core.store import require_own, require_place
from pdrom.model.scene import Scene
from pdrom.view import style
from pdrom.view.artists import Figure
from pdrom.view.multiples import clipped, log_axis
from pdrom.view.page import ViewedRun, ViewedScene, write_page

LOW, HIGH = 1e-7, 1e3  # limits of the error axis; errors outside are drawn on the limit


def plot(*runs: ReducedRun) -> Figure:
    """Plot errors of reduced runs against time; a cross marks the end of a run that blew up.

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
        An argument is no reduced run; there is no argument.
    """
    if not runs:
        raise SceneError("plot: at least one run is required")
    for run in runs:
        require_run(ReducedRun, run, "plot", source="pdrom.api.reduce makes one, load reads one")
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


def view(path: str | os.PathLike[str], *runs: AnyRun) -> None:
    """Write a page (HTML, one file) that shows runs; a browser opens it without a network.

    A reduced run is shown with its full-order run. Runs with equal scenes are shown together.

    Parameters
    ----------
    path : file to write
    runs : full-order and reduced runs

    Raises
    ------
    ConfigurationError, SceneError, StorageError
        An argument is no run; no run is given, or two different scenes have one name; the page
        would be too large, or cannot be written.
    """
    require_place(file_path(path))
    require_own(path)
    write_page(viewed_scenes(*runs), path)


def viewed_scenes(*runs: AnyRun) -> list[ViewedScene]:
    """Collect ``runs`` of any kind by scene, for pictures and pages.

    ConfigurationError if an argument is no run, SceneError without arguments or if two different
    scenes have one name.
    """
    if not runs:
        raise SceneError("view: at least one run is required")
    scenes: dict[str, list[AnyRun]] = {}
    for run in runs:
        require_run(get_args(AnyRun), run, "view", source="pdrom.api.run and reduce make one")
        known = scenes.setdefault(_scene(run).config.name, [])
        if known and _scene(known[0]).config != _scene(run).config:
            raise SceneError(f"view: two different scenes are called '{_scene(run).config.name}'")
        known.append(run)
    return [_viewed(of_scene) for of_scene in scenes.values()]


def _scene(run: AnyRun) -> Scene:
    return run.full.scene if isinstance(run, ReducedRun) else run.scene


def _viewed(runs: list[AnyRun]) -> ViewedScene:
    """Prepare ``runs`` of a scene; reduced runs are shown with the first full-order run."""
    first = runs[0].full if isinstance(runs[0], ReducedRun) else runs[0]
    reduced = [run for run in runs if isinstance(run, ReducedRun)]
    config = first.scene.config
    return ViewedScene(
        name=config.name,
        title=config.title,
        mesh=first.scene.mesh,
        time_step=config.time_step,
        positions=first.positions,
        ms=float(np.median(first.ms)),
        runs=tuple(_shown(run) for run in sorted(reduced, key=lambda run: run.r)),
        effects=config.effects,
    )


def _shown(run: ReducedRun) -> ViewedRun:
    """Prepare a reduced run for a page."""
    moved, blowup = np.asarray(run.outcome.positions), run.outcome.blowup_frame
    ms = run.ms if np.isfinite(run.ms) else None
    return ViewedRun(run.group, run.method, run.r, moved, run.error, blowup, ms)
