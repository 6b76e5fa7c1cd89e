"""A scene with several groups: the full-order run, then one group reduced at a time."""

from matplotlib.figure import Figure

from pdrom.core.paths import FULL_ORDER, MESH, RERUNS
from pdrom.model.mesh.types import load_mesh
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.camera import Camera
from pdrom.report.figures.kit.floor import Floors
from pdrom.report.figures.kit.options import ReducedRuns
from pdrom.report.figures.kit.panels import (
    RunPanel,
    fit_aspect,
    shared_window,
)
from pdrom.report.figures.kit.read import (
    choose_ranks,
    positions_at,
    rerun_infos,
)
from pdrom.report.figures.kit.results import NothingToDraw, Results, asked
from pdrom.report.figures.kit.run_rows import NOTHING_RAN, Row, draw_rows, run_panel


def draw(results: Results, options: ReducedRuns) -> Figure:
    """One row per reduced group and method (first the full-order run), one column per instant.

    All pictures have the same camera and scale but for framed ones, whose scale is given. The size
    is the first of ``options.ranks`` that ran. Raises StorageError if a file of the results is
    missing or damaged.
    """
    camera = Camera(options.azimuth, options.elevation)
    found = results.holdings.first(options)
    if found is None:
        raise NothingToDraw(asked(options))
    scene, floors = found[0], Floors(results)
    mesh = load_mesh(results.path(MESH, scene))
    frames, full = positions_at(results.path(FULL_ORDER, scene), options.frames)
    first = [
        RunPanel(floors.instant(scene, f), style.FULL_ORDER, q, reference=True)
        for f, q in zip(frames, full, strict=True)
    ]
    table = [("full order", first, None)]
    for group in results.holdings.scenes[scene].groups:
        for method in results.methods(options):
            table.append(_grid_row(results, options, (scene, group, method), frames))
    windows = [shared_window(camera, q, []) for q in full]
    size = (max(w.width for w in windows), max(w.height for w in windows))
    windows = [fit_aspect(w.resized(*size)) for w in windows]
    panels = [([p.seen_by(camera) for p in row], label, note) for label, row, note in table]
    return draw_rows(
        [Row(label, mesh, row, windows, full, note) for row, label, note in panels], camera
    )


def _grid_row(
    results: Results, options: ReducedRuns, experiment: tuple[str, str, str], frames: list[int]
) -> tuple[str, list[RunPanel], str | None]:
    _, group, method = experiment
    path = results.path(RERUNS, *experiment)
    infos = choose_ranks(rerun_infos(path), options.ranks)
    info = next((i for i in infos if not i.marked), infos[0]) if infos else None
    label = f"{style.words(group)} reduced\n{results.method_title(method)}"
    if info is None or info.marked:
        blank = RunPanel("", style.GREY, None)
        return label, [blank] * len(frames), NOTHING_RAN
    colour = style.surface_colour(style.group_looks(results.holdings)[group][0])
    return f"{label}\n{info.title}", [run_panel(path, info, f, colour, "") for f in frames], None
