"""The preprint's reduction, a sound one and one that pays, in one scene at one instant."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.core.store import open_hdf5
from pdrom.view import style
from pdrom.view.artists import Figure
from pdrom.view.panels import RunPanel
from pdrom.view.read import positions_at
from pdrom.view.run_rows import Row, draw_rows
from study.artifact.paths import FULL_ORDER, SUBSPACES
from study.artifact.reads import Chosen, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.experiment_rows import RUNS, experiment_rows
from study.figures.kit.floor import Floors
from study.figures.kit.options import ReducedRuns
from study.figures.kit.results import NothingToDraw, Results, asked

TOLERANCE = "ecsw-1e-02"


class Options(ReducedRuns):
    """Choices."""

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
    reads=(*RUNS, Chosen(SUBSPACES), TableOf("reduced_reruns")),
    options=Options,
)
def teaser(results: Results, options: Options) -> Figure:
    """Draw a row per experiment: the full order, a panel per method, a sampled subspace."""
    experiments, floors = results.experiments(options), Floors(results)
    if not experiments or not results.methods(options):
        raise NothingToDraw(asked(options))
    errors = results.table("reduced_reruns")
    rows = [
        _merged(results, options, experiment_rows(results, options, floors, *each), errors, each)
        for each in experiments
    ]
    return draw_rows(rows, options.camera)


def _merged(
    results: Results,
    options: Options,
    rows: list[Row],
    errors: pd.DataFrame,
    experiment: tuple[str, str],
) -> Row:
    """Rows of an experiment as one, its panels named by their methods."""
    scene, group = experiment
    first = rows[0]
    panels = first.panels[:1]
    if first.note is None:
        own = errors[(errors.scene == scene) & (errors.group == group)]
        for method, row in zip(results.methods(options), rows, strict=True):
            found = own[(own.method == method) & (own.position_basis == "full")]
            panels += [_with_error(p, method, found, "r") for p in row.panels[1:]]
    subspace = _subspace(results, options, scene)
    if subspace is not None:
        found = errors[(errors.scene == scene) & (errors.position_basis == "pod")]
        found = found[found.method == TOLERANCE]
        panels.append(_with_error(subspace, "ecsw", found, "k"))
    label = f"{results.experiment_title(scene, group)}\n{first.label.splitlines()[-1]}"
    ghosts = np.repeat(first.ghosts[:1], len(panels), axis=0)
    windows = first.windows[:1] * len(panels)
    return replace(first, label=label, panels=panels, windows=windows, ghosts=ghosts)


def _with_error(panel: RunPanel, method: str, rows: pd.DataFrame, size: str) -> RunPanel:
    """A panel with its method in the title, and its error before the horizon below."""
    number = int(panel.title.split()[2])
    error = rows[rows[size] == number].relative_error_within_horizon.dropna()
    remark = f"error {error.iloc[0]:.2g}" if len(error) else panel.remark
    return replace(panel, title=f"{method}, {size} = {number}", remark=remark)


def _subspace(results: Results, options: Options, scene: str) -> RunPanel | None:
    """Panel of the run with sampled elements; None where a configuration has none of that size."""
    path = results.path(SUBSPACES, scene)
    base = f"pod_k{options.modes:03d}"
    if not Path(path).is_file():
        return None
    title, colour = f"k = {options.modes}", style.surface_colour(style.GREEN)
    (frame,), _ = positions_at(results.path(FULL_ORDER, scene), options.frames[-1:])
    with open_hdf5(path) as file:
        run = file["models"].get(f"{base}_{TOLERANCE}")
        if run is None:
            return None
        stored = run["train"]["coordinates"]
        if len(stored) <= frame:
            return RunPanel(title, colour, None, "blew up")
        positions = file["columns"][base]["B"][...] @ stored[frame]
    return RunPanel(title, colour, positions).seen_by(options.camera)
