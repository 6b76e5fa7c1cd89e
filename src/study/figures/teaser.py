"""The preprint's reduction, a sound one and one that pays, in one scene at one instant."""

from dataclasses import replace

import numpy as np
import pandas as pd

from pdrom.core.store import open_hdf5
from pdrom.view import style
from pdrom.view.artists import Figure
from pdrom.view.panels import Row, RunPanel, draw_rows
from study.artifact.paths import SUBSPACES, File
from study.artifact.reads import EachOf, TableOf
from study.experiments.kit.settings import Horizon
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, Experiment, NothingToDraw, ReducedRuns
from study.figures.runs import RUNS, Runs, experiment_rows
from study.tables.kit.reruns import trained

TOLERANCE = "ecsw-1e-02"


class Options(ReducedRuns):
    """Options of the figure."""

    modes: int = 20


@figure(
    title="Two scenes under five reductions",
    caption=(
        "One instant of the motion that trained all of them. `deim-joint` is the preprint's "
        "method: joint rows, a system for each axis. `deim` samples single entries, `block-deim` "
        "whole elements, `gappy` three elements a mode, all with shared coefficients. `ecsw` "
        "reduces positions and sums sampled elements with non-negative weights. $r$ and $k$ are "
        "numbers of modes, errors are relative to the motion; the outline is the full order. "
        "A framed picture is drawn to the smaller scale given below it."
    ),
    reads={
        **RUNS,
        "subspaces": EachOf(SUBSPACES, "drawn_subspaces"),
        "errors": TableOf("reduced_reruns"),
    },
    options=Options,
)
def teaser(
    options: Options,
    drawn: Drawn,
    horizon: Horizon,
    subspaces: list[File],
    errors: pd.DataFrame,
    **files: list[File],
) -> Figure:
    """Draw a row per experiment: the full order, a panel per method, a sampled subspace."""
    if not drawn.experiments or not drawn.methods:
        raise NothingToDraw(options.words())
    runs, rows = Runs(horizon, **files), []
    for each in drawn.experiments:
        found = experiment_rows(options, drawn, runs, each)
        subspace = _subspace(options, runs, each, each.find(subspaces))
        rows.append(_merged(drawn, each, found, trained(errors), subspace, len(options.ranks) or 1))
    return draw_rows(rows)


def _merged(
    drawn: Drawn,
    experiment: Experiment,
    rows: list[Row],
    errors: pd.DataFrame,
    subspace: RunPanel | None,
    most: int,
) -> Row:
    """Rows of an experiment as one, its panels named by their methods, ``most`` of each."""
    scene, group, first = experiment.scene, experiment.group, rows[0]
    panels = first.panels[:1]
    if first.note is None:
        own = errors[(errors.scene == scene) & (errors.group == group)]
        for method, row in zip(drawn.methods, rows, strict=True):
            found = own[(own.method == method) & (own.position_basis == "full")]
            ran = [panel for panel in row.panels[1:] if panel.positions is not None]
            # the largest sizes where the study has none of those that are chosen
            sizes = (ran or row.panels[1:])[-most:]
            panels += [_with_error(panel, method, found, "r") for panel in sizes]
    if subspace is not None:
        found = errors[(errors.scene == scene) & (errors.position_basis == "pod")]
        found = found[found.method == TOLERANCE]
        panels.append(_with_error(subspace, "ecsw", found, "k"))
    panels = [replace(panel, obstacles=first.panels[0].obstacles) for panel in panels]
    label = f"{experiment.title}\n{first.label.splitlines()[-1]}"
    ghosts = np.repeat(first.ghosts[:1], len(panels), axis=0)
    windows = first.windows[:1] * len(panels)
    return replace(first, label=label, panels=panels, windows=windows, ghosts=ghosts)


def _with_error(panel: RunPanel, method: str, rows: pd.DataFrame, size: str) -> RunPanel:
    """A panel with its method in the title, and its error before the horizon below."""
    number = int(panel.title.split()[2])
    error = rows[rows[size] == number].relative_error_within_horizon.dropna()
    remark = f"error {error.iloc[0]:.2g}" if len(error) else panel.remark
    return replace(panel, title=f"{method}, {size} = {number}", remark=remark)


def _subspace(
    options: Options, runs: Runs, experiment: Experiment, path: str | None
) -> RunPanel | None:
    """Panel of the run with sampled elements; None where a configuration has none that small."""
    if path is None:
        return None
    colour = style.surface_colour(style.GREEN)
    (frame,), _ = runs.at(experiment, options.frames[-1:])
    with open_hdf5(path) as file:
        models = file["models"]
        sizes = [k for k in range(options.modes, 0, -1) if f"pod_k{k:03d}_{TOLERANCE}" in models]
        if not sizes:
            return None
        title, base = f"k = {sizes[0]}", f"pod_k{sizes[0]:03d}"
        stored = models[f"{base}_{TOLERANCE}"]["train"]["coordinates"]
        if len(stored) <= frame:
            return RunPanel(title, colour, None, "blew up")
        positions = file["columns"][base]["B"][...] @ stored[frame]
    return RunPanel(title, colour, positions).seen_by(options.camera(experiment))
