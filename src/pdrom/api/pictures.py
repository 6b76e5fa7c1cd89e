"""Pictures of runs, and a page to look at them."""

import os

import numpy as np
from matplotlib.figure import Figure

from pdrom.api.runs import FullRun, ReducedRun
from pdrom.core.errors import SceneError
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import clipped, log_axis
from pdrom.report.viewer.page import write_page
from pdrom.report.viewer.runs import ViewedRun, ViewedScene

LOW, HIGH = 1e-7, 1e3  # errors outside are drawn on the limit


def plot(*runs: ReducedRun) -> Figure:
    """Errors of reduced runs against time; a cross ends a run that blew up.

    ``plot(...).savefig("errors.png")`` writes the picture.
    """
    with style.look():
        figure = Figure(figsize=(style.WIDTH, 3.0), layout="constrained")
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

    Raises
    ------
    SceneError
        No run is given, or two scenes that differ have the same name.
    """
    if not runs:
        raise SceneError("view: at least one run is required")
    scenes: dict[str, tuple[FullRun, list[ReducedRun]]] = {}
    for run in runs:
        full = run.full if isinstance(run, ReducedRun) else run
        name = full.scene.config.name
        known, reduced = scenes.setdefault(name, (full, []))
        if known.scene.config != full.scene.config:
            raise SceneError(f"view: two different scenes are called '{name}'")
        if isinstance(run, ReducedRun):
            reduced.append(run)
    write_page([_viewed(full, reduced) for full, reduced in scenes.values()], path)


def _viewed(full: FullRun, reduced: list[ReducedRun]) -> ViewedScene:
    config = full.scene.config
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
                r=run.r,
                positions=run.outcome.positions,
                error=run.error,
                blowup_frame=run.outcome.blowup_frame,
                ms=run.ms if np.isfinite(run.ms) else None,
            )
            for run in reduced
        ),
        effects=config.effects,
    )
