"""Rows of experiments: a full-order run beside the reduced ones."""

from collections.abc import Callable

import numpy as np

from pdrom.model.mesh.types import load_mesh
from pdrom.view import style
from pdrom.view.artists import Figure
from pdrom.view.panels import RunPanel, shared_window
from pdrom.view.read import choose_ranks, positions_at, rerun_infos
from pdrom.view.run_rows import NOTHING_RAN, Row, draw_rows, run_panel
from study.artifact.paths import FULL_ORDER, MESH, RERUNS
from study.artifact.reads import Chosen
from study.figures.kit.floor import FLOORS, Floors
from study.figures.kit.legends import group_looks
from study.figures.kit.options import ReducedRuns
from study.figures.kit.results import NothingToDraw, Results, asked

RUNS = (Chosen(MESH), Chosen(FULL_ORDER), Chosen(RERUNS), *FLOORS)
RowsOf = Callable[[Results, ReducedRuns, Floors, str, str], list[Row]]


def experiment_rows(
    results: Results, options: ReducedRuns, floors: Floors, scene: str, group: str
) -> list[Row]:
    """A row per method; a single one that says so where no method has anything to reduce."""
    camera = options.camera
    colour = style.surface_colour(group_looks(results.holdings)[group][0])
    frames, full = positions_at(results.path(FULL_ORDER, scene), options.frames[-1:])
    frame, mesh = frames[0], load_mesh(results.path(MESH, scene))
    when = floors.instant(scene, frame).replace(", ", "\n")
    reference = RunPanel("full order", style.FULL_ORDER, full[0], reference=True)
    runs = {}
    for method in results.methods(options):
        path = results.path(RERUNS, scene, group, method)
        infos = choose_ranks(rerun_infos(path), options.ranks)
        runs[method] = [
            run_panel(path, i, frame, colour=colour, title=i.title).seen_by(camera) for i in infos
        ]
    everything = [panel for panels in runs.values() for panel in panels]
    window = shared_window(camera, full[0], everything)
    title = results.experiment_title(scene, group)
    reference = reference.seen_by(camera)
    if all(panel.positions is None and not panel.failure for panel in everything):
        label = f"{title}\nany method\n{when}"
        return [Row(label, mesh, [reference], [window], full, NOTHING_RAN)]
    return [
        Row(
            f"{title}\n{results.method_title(method)}\n{when}",
            mesh,
            [reference, *panels],
            [window] * (len(panels) + 1),
            np.repeat(full, len(panels) + 1, axis=0),
        )
        for method, panels in runs.items()
    ]


def draw_experiments(
    results: Results, options: ReducedRuns, rows_of: RowsOf = experiment_rows
) -> Figure:
    """Draw a row per experiment and method: the full-order run, then the reduced ones by size.

    All pictures of an experiment show the same instant, the last one of ``options.frames``,
    with the same camera; one that does not fit is framed and its scale is given. The grey outline
    is the full-order run. Runs are those of ``results``.

    rows_of : rows of one experiment
    """
    experiments = results.experiments(options)
    if not experiments or not results.methods(options):
        raise NothingToDraw(asked(options))
    floors = Floors(results)
    rows: list[Row] = []
    for scene, group in experiments:
        rows += rows_of(results, options, floors, scene, group)
    return draw_rows(rows, options.camera)
