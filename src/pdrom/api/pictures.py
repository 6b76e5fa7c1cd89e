"""Plots of errors, and HTML pages that show runs."""

import os

import numpy as np
import pandas as pd

from pdrom.api.files import output, require_run
from pdrom.api.records import FULL, FULL_MODEL, Run
from pdrom.core.errors import SceneError
from pdrom.view import style
from pdrom.view.artists import Figure
from pdrom.view.frames import write_frames
from pdrom.view.page import ViewedRun, ViewedScene, write_page

LOW, HIGH = 1e-7, 1e3  # limits of the error axis; errors outside are drawn on the limit
# The part of a setting in words that does not name its mesh or model.
COUNT = r"(^|, )(converged|\d+ iterations?(, Anderson)?)( on )?"


def plot(reference: Run, *runs: Run) -> Figure:
    """Plot errors of runs against time; a cross marks the end of a run that blew up.

    Each of ``runs`` gets a line: its relative position error against ``reference``, such as the
    full-order run of the scene, in every frame. Errors below 1e-7 or above 1e3 are drawn at these
    limits. ``plot(...).savefig("errors.png")`` writes the picture. ConfigurationError or SceneError
    if no ``runs`` are given, or an argument is no run or not comparable with ``reference``.
    """
    if not runs:
        raise SceneError("plot: at least one run and its reference are required")
    for run in (reference, *runs):
        require_run(run, "plot")
        run.require_comparable(reference)
    with style.look():
        figure = style.new_figure(3.0)
        ax = figure.subplots()
        errors = [np.clip(run.errors(reference), LOW, HIGH) for run in runs]
        whole = np.log10(np.concatenate([*errors, [1e-3, 1.0]]))
        style.log_axis(ax, 10.0 ** np.floor(np.nanmin(whole)), 10.0 ** np.ceil(np.nanmax(whole)))
        for i, (run, error) in enumerate(zip(runs, errors, strict=True)):
            time = run.scene.config.time_step * np.arange(1, len(error) + 1)
            colour = style.CYCLE[i % len(style.CYCLE)]
            ax.plot(time, error, color=colour, label=run.method.replace(FULL, FULL_MODEL))
            if run.blowup_frame is not None and len(time):
                ax.plot(time[-1:], error[-1:], color=colour, marker="x", markersize=5)
        ax.set_xlim(0.0, None)
        ax.set_xlabel("time in s")
        ax.set_ylabel("relative position error")
        ax.legend(loc="upper left")
    return figure


def plot_cost(table: pd.DataFrame) -> Figure:
    """Plot error against time of a ``table`` by `pdrom.api.cost`; a line joins the best settings.

    A dashed line shows the error due to the mesh. Settings without a finite error are left out.
    """
    table = table[np.isfinite(table.position_error)]
    places = table.setting.str.replace(COUNT, "", regex=True).map(style.plain_words)
    table = table.assign(error=table.position_error.clip(LOW, HIGH), place=places)
    with style.look():
        figure = style.new_figure(3.5)
        ax = figure.subplots()
        best, mesh = table[table.best], table.attrs["mesh_error"]
        ax.plot(best.ms, best.error, color=style.GREY, zorder=1, label="best settings")
        for i, (place, own) in enumerate(table.groupby("place")):
            label = place or "the scene's mesh"
            ax.scatter(own.ms, own.error, color=style.CYCLE[i % len(style.CYCLE)], label=label)
        for row in table.itertuples():
            text = f"{row.iterations}{' A' * ('Anderson' in row.setting)}".replace("<NA>", "N")
            ax.annotate(text, (row.ms, row.error), (3, 3), textcoords="offset points")
        if mesh is not None:
            ax.axhline(mesh, color=style.BLACK, ls="--", label="error of the mesh")
        ax.set(xscale="log", yscale="log", ylabel="position error")
        ax.set_xlabel("ms a frame (marks: iterations; A: Anderson acceleration; N: Newton)")
        style.legend(figure, ax.get_legend_handles_labels()[0], 3)
    return figure


def view(path: str | os.PathLike[str], *runs: Run) -> None:
    """Write an HTML page (one file) that shows runs and opens without a network.

    Runs of equal scenes are shown together and compared with the full-order run among them. If
    ``path`` ends in .png, a picture with four frames of each run is written, for runs of one scene.
    PdromError if no run is given, an argument is no run, two different scenes have the same name,
    or the page would be too large or cannot be written.
    """
    path, scenes = output(path), viewed_scenes(*runs)
    if path.suffix.lower() != ".png":
        write_page(scenes, path)
        return
    if len(scenes) > 1:
        raise SceneError(f"{path}: a picture shows one scene; the runs are of {len(scenes)}")
    write_frames(scenes[0], path)


def viewed_scenes(*runs: Run) -> list[ViewedScene]:
    """Collect ``runs`` of any kind by scene, for pictures and pages.

    Runs are compared with the first full-order run of their scene, or else its first run.
    ConfigurationError if an argument is no run, SceneError without arguments or if two different
    scenes have one name.
    """
    if not runs:
        raise SceneError("view: at least one run is required")
    scenes: dict[str, list[Run]] = {}
    for run in runs:
        require_run(run, "view")
        known = scenes.setdefault(run.scene.config.name, [])
        if known and known[0].scene.config != run.scene.config:
            raise SceneError(f"view: two different scenes are called '{run.scene.config.name}'")
        known.append(run)
    return [_viewed(of_scene) for of_scene in scenes.values()]


def _viewed(runs: list[Run]) -> ViewedScene:
    first = next((run for run in runs if run.full_order), runs[0])
    config, shown = first.scene.config, []
    for run in (each for each in runs if each is not first):
        ms = float(np.median(run.ms)) if len(run.ms) else None
        errors, label = run.errors(first), run.method.replace(FULL, FULL_MODEL)
        shown.append(ViewedRun(label, run.positions, errors, run.blowup_frame, ms))
    return ViewedScene(
        name=config.name, title=config.title, mesh=first.scene.mesh, time_step=config.time_step,
        positions=first.positions, ms=float(np.median(first.ms)), effects=config.effects,
        runs=tuple(shown), method=first.method.replace(FULL, FULL_MODEL),
    )  # fmt: skip
