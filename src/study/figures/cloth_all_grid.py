"""The cloth with three groups: full order, and with one group reduced, over time."""

from dataclasses import replace

import numpy as np

from pdrom.model.mesh.types import Mesh
from pdrom.view import style
from pdrom.view.artists import Figure, ScalarMappable
from pdrom.view.panels import (
    NOTHING_RAN,
    Row,
    RunPanel,
    draw_rows,
    fit_aspect,
    run_panel,
    shared_window,
)
from pdrom.view.read import choose_ranks, rerun_infos
from study.artifact.paths import File
from study.experiments.kit.settings import Horizon
from study.figures.kit.declaration import figure
from study.figures.kit.elements import magnitudes
from study.figures.kit.options import Drawn, NothingToDraw, ReducedRuns
from study.figures.runs import RUNS, Runs

DISTANCES = (1e-4, 1.0)  # extents of the mesh, at the ends of the scale of colours
FOOTER = 0.55  # inches, for the scale of colours


@figure(
    number=4,
    title="Three constraint groups, one of them reduced",
    caption=(
        "The cloth with bending, springs and strain at instants up to the scene's horizon, beyond "
        "which no difference could be blamed on a reduction: the full-order run, then runs that "
        "reduce the projections of one group only, by two methods. Triangles are coloured by "
        "their distance to the full-order run, whose outline is grey; a framed picture is drawn to "
        "the smaller scale given below it. Springs carry nearly all of the force, so that reducing "
        "strain changes little whatever the method."
    ),
    reads=RUNS,
    options=ReducedRuns,
)
def cloth_all_grid(
    options: ReducedRuns, drawn: Drawn, horizon: Horizon, **files: list[File]
) -> Figure:
    """Draw a row per reduced group (first the full-order run), the methods side by side.

    A method has a column for each instant; instants are shares of the scene's horizon. All pictures
    have the same camera and scale but for framed ones, whose scale is given. The size is the first
    of ``options.ranks`` that ran.
    """
    methods, runs = drawn.methods, Runs(horizon, **files)
    if not drawn.experiments or not methods:
        raise NothingToDraw(options.words())
    one = drawn.experiments[0]
    camera = options.camera(one)
    mesh, end = runs.mesh(one), runs.floors.horizon(one.scene)
    frames, full = runs.at(one, options.frames, end)
    first = [
        RunPanel(f"frame {f}", style.FULL_ORDER, q, reference=True)
        for f, q in zip(frames, full, strict=True)
    ]
    rows: list[tuple[str, list[RunPanel], str | None]] = [
        ("full order", first * len(methods), None)
    ]
    for each in drawn.of(one.scene):
        reduced = [
            _run(each.path(runs.reruns, method=m), options, drawn.title(m), frames, full, mesh)
            for m in methods
        ]
        label, ran = f"{style.words(each.group)} reduced", any(reduced)
        blank = [RunPanel("", style.GREY, None, remark="not run")] * len(frames)
        panels = [panel for run in reduced for panel in run or blank]
        rows.append((label, panels, None if ran else NOTHING_RAN))
    windows = [shared_window(camera, q, [], margin=0.04) for q in full]
    size = (max(w.width for w in windows), max(w.height for w in windows))
    windows = [fit_aspect(w.resized(*size)) for w in windows] * len(methods)
    ghosts = np.concatenate([full] * len(methods))
    made = [
        Row(label, mesh, [panel.seen_by(camera) for panel in panels], windows, ghosts, camera, note)
        for label, panels, note in rows
    ]
    figure = draw_rows(made, footer=FOOTER)
    _draw_scale(figure)
    return figure


def _run(
    path: str, options: ReducedRuns, title: str, frames: list[int], full: np.ndarray, mesh: Mesh
) -> list[RunPanel] | None:
    """A reduced run at every instant, coloured by its distance; None if no size ran."""
    infos = choose_ranks(rerun_infos(path), options.ranks)
    info = next((i for i in infos if not i.marked), None)
    if info is None:
        return None
    plain = style.surface_colour(style.GREY)
    panels = [
        _coloured(run_panel(path, info, frame, colour=plain, title=""), q, mesh)
        for frame, q in zip(frames, full, strict=True)
    ]
    middle = len(panels) // 2
    panels[middle] = replace(panels[middle], title=f"{title}, {info.title}")
    return panels


def _coloured(panel: RunPanel, full: np.ndarray, mesh: Mesh) -> RunPanel:
    """The panel with each triangle coloured by its distance to the full-order run."""
    if panel.positions is None or panel.failure:
        return panel
    distance = np.linalg.norm(panel.positions - full, axis=1) / mesh.extent
    return replace(panel, colour=_colours().to_rgba(distance[mesh.triangles].mean(axis=1))[:, :3])


def _colours() -> ScalarMappable:
    from matplotlib.colors import LogNorm

    return magnitudes(LogNorm(*DISTANCES, clip=True))


def _draw_scale(figure: Figure) -> None:
    inch = 1.0 / figure.get_figheight()
    ax = figure.add_axes((0.3, 0.40 * inch, 0.5, 0.08 * inch))
    bar = figure.colorbar(_colours(), cax=ax, orientation="horizontal", extend="both")
    bar.set_label("distance to the full-order run (extents)", labelpad=1)
    bar.outline.set_linewidth(0.4)
