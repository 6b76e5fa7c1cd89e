"""Full-order runs beside reduced ones (figures 4 to 7 of the paper, and the bars)."""

import os
import textwrap
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure

from pdrom.model.mesh.types import Mesh, load_mesh
from pdrom.report.figures import style
from pdrom.report.figures.camera import Camera, Window
from pdrom.report.figures.floor import instant
from pdrom.report.figures.panels import (
    SLACK,
    RunPanel,
    centre_note,
    draw_run,
    fit_aspect,
    shared_window,
)
from pdrom.report.figures.read import (
    RerunInfo,
    choose_ranks,
    positions_at,
    rerun_infos,
    rerun_positions,
)
from pdrom.report.figures.sources import Sources
from pdrom.report.figures.spec import FigureSpec

HEIGHT_LIMIT = 9.3  # inches, a page
LEFT = 1.0  # inches, for the row labels
ABOVE, LINE, BELOW = 0.19, 0.13, 0.07  # inches: title, a line of remarks, gap
NOTHING_RAN = "not run: the projections are round-off, there is nothing to reduce"


@dataclass(frozen=True)
class Row:
    """Panels of one row; ``ghosts`` (n, N, 3) m are outlined behind the reduced runs.

    note : text in place of the reduced runs, for an experiment in which none ran
    """

    label: str
    mesh: Mesh
    panels: list[RunPanel]
    windows: list[Window]
    ghosts: np.ndarray
    note: str | None = None

    @property
    def aspect(self) -> float:
        """Height over width of the tallest picture; flat for a row without any."""
        heights = [
            w.height / w.width
            for panel, w in zip(self.panels, self.windows, strict=True)
            if panel.positions is not None
        ]
        return max(heights, default=0.28)

    @property
    def lines(self) -> int:
        """Lines of text below the pictures."""
        failed = [
            bool(p.failure) + bool(p.remark) + (p.scale(w) > SLACK)
            for p, w in zip(self.panels, self.windows, strict=True)
            if p.positions is not None
        ]
        return max(failed, default=0)


@style.styled
def draw(sources: Sources, spec: FigureSpec) -> Figure:
    """One row per experiment and method: the full-order run, then the reduced ones by size.

    All pictures of an experiment show the same instant, the last one of ``spec.frames``, with the
    same camera; one that does not fit is framed and its scale is given. The grey outline is the
    full-order run. An experiment in which no reduced run exists has a single row that says so.

    Raises
    ------
    StorageError
        A file of the results is missing or damaged.
    """
    camera = Camera(spec.azimuth, spec.elevation)
    methods = sources.holdings.methods(spec.methods)
    experiments = sources.holdings.experiments(spec.scenes, spec.groups)
    if not experiments or not methods:
        return style.no_data(f"{', '.join(spec.scenes)} with {', '.join(spec.methods)}")
    rows: list[Row] = []
    for scene, group in experiments:
        rows += _experiment_rows(sources, spec, camera, scene, group, methods)
    return _draw_rows(rows, camera)


@style.styled
def draw_grid(sources: Sources, spec: FigureSpec) -> Figure:
    """One row per reduced group and method (first the full-order run), one column per instant.

    All pictures have the same camera and scale but for framed ones, whose scale is given. The size
    is the first of ``spec.ranks`` that ran. Raises StorageError as `draw`.
    """
    camera = Camera(spec.azimuth, spec.elevation)
    found = sources.holdings.first(spec.scenes, spec.groups, spec.methods)
    if found is None:
        return style.no_data(f"{', '.join(spec.scenes)} with {', '.join(spec.methods)}")
    scene = found[0]
    mesh = load_mesh(sources.mesh(scene))
    frames, full = positions_at(sources.run(scene), spec.frames)
    first = [
        RunPanel(instant(sources, spec, scene, f), style.FULL_ORDER, q, reference=True)
        for f, q in zip(frames, full, strict=True)
    ]
    table = [("full order", first, None)]
    for group in sources.holdings.scenes[scene].groups:
        for method in sources.holdings.methods(spec.methods):
            table.append(_grid_row(sources, spec, (scene, group, method), frames))
    windows = [shared_window(camera, q, []) for q in full]
    size = (max(w.width for w in windows), max(w.height for w in windows))
    windows = [fit_aspect(w.resized(*size)) for w in windows]
    panels = [([p.seen_by(camera) for p in row], label, note) for label, row, note in table]
    return _draw_rows(
        [Row(label, mesh, row, windows, full, note) for row, label, note in panels], camera
    )


def _grid_row(
    sources: Sources, spec: FigureSpec, experiment: tuple[str, str, str], frames: list[int]
) -> tuple[str, list[RunPanel], str | None]:
    _, group, method = experiment
    path = sources.rerun(*experiment)
    infos = choose_ranks(rerun_infos(path), spec.ranks)
    info = next((i for i in infos if not i.marked), infos[0]) if infos else None
    label = f"{style.words(group)} reduced\n{sources.holdings.title(method)}"
    if info is None or info.marked:
        blank = RunPanel("", style.GREY, None)
        return label, [blank] * len(frames), NOTHING_RAN
    colour = style.surface_colour(group)
    return f"{label}\n{info.title}", [_panel(path, info, f, colour, "") for f in frames], None


def _experiment_rows(
    sources: Sources,
    spec: FigureSpec,
    camera: Camera,
    scene: str,
    group: str,
    methods: list[str],
) -> list[Row]:
    frames, full = positions_at(sources.run(scene), spec.frames[-1:])
    frame, mesh = frames[0], load_mesh(sources.mesh(scene))
    when = instant(sources, spec, scene, frame).replace(", ", "\n")
    reference = RunPanel("full order", style.FULL_ORDER, full[0], reference=True)
    runs = {}
    for method in methods:
        path = sources.rerun(scene, group, method)
        infos = choose_ranks(rerun_infos(path), spec.ranks)
        colour = style.surface_colour(group)
        runs[method] = [_panel(path, i, frame, colour, i.title).seen_by(camera) for i in infos]
    everything = [panel for panels in runs.values() for panel in panels]
    window = shared_window(camera, full[0], everything)
    title = sources.title(scene, group)
    reference = reference.seen_by(camera)
    if all(panel.positions is None and not panel.failure for panel in everything):
        label = f"{title}\nany method\n{when}"
        return [Row(label, mesh, [reference], [window], full, NOTHING_RAN)]
    return [
        Row(
            f"{title}\n{sources.holdings.title(method)}\n{when}",
            mesh,
            [reference, *panels],
            [window] * (len(panels) + 1),
            np.repeat(full, len(panels) + 1, axis=0),
        )
        for method, panels in runs.items()
    ]


def _panel(
    path: str | os.PathLike[str],
    info: RerunInfo,
    frame: int,
    colour: tuple[float, float, float],
    title: str,
) -> RunPanel:
    """Panel of a reduced run at ``frame``; what it says about a run that failed or never began."""
    if info.marked:
        return RunPanel(title, colour, None, remark="not run: r exceeds\nthe numerical rank")
    blew_up = 0 <= info.blowup_frame < frame
    failure = f"blew up at frame {info.blowup_frame}" if blew_up else None
    found = rerun_positions(path, info, frame)
    if found is None:
        return RunPanel(title, colour, None, failure or "no finite positions")
    entry, positions = found
    drawn = f"frame {entry}" if entry else "initial state"
    remark = f"drawn: {drawn}" if failure else None
    return RunPanel(title, colour, positions, failure, remark)


def _draw_rows(rows: list[Row], camera: Camera) -> Figure:
    columns = max(len(row.panels) for row in rows)
    width = (style.WIDTH - LEFT) / columns
    texts = sum(ABOVE + BELOW + LINE * row.lines for row in rows)
    pictures = sum(0.96 * width * row.aspect for row in rows)
    shrink = min(1.0, (HEIGHT_LIMIT - texts) / pictures)
    heights = [
        shrink * 0.96 * width * row.aspect + ABOVE + BELOW + LINE * row.lines for row in rows
    ]
    figure = Figure(figsize=(style.WIDTH, sum(heights)))
    tops = 1.0 - np.concatenate([[0.0], np.cumsum(heights)]) / sum(heights)
    for row, (top, bottom) in zip(rows, pairwise(tops), strict=True):
        _draw_row(figure, row, camera, columns, top, bottom)
    return figure


def _draw_row(
    figure: Figure, row: Row, camera: Camera, columns: int, top: float, bottom: float
) -> None:
    inch = 1.0 / figure.get_figheight()
    low, high = bottom + (BELOW + LINE * row.lines) * inch, top - ABOVE * inch
    left = LEFT / style.WIDTH
    step = (1.0 - left) / columns
    drawn = [] if row.note and row.panels[0].positions is None else row.panels
    for i, panel in enumerate(drawn):
        ax = figure.add_axes((left + (i + 0.02) * step, low, 0.96 * step, high - low))
        ghost = None if panel.reference else row.ghosts[i]
        draw_run(ax, row.mesh, panel, camera, row.windows[i], ghost)
    if row.note:
        start = left + len(drawn) * step
        ax = figure.add_axes((start, low, 1.0 - start, high - low))
        ax.set_axis_off()
        centre_note(ax, row.note)
    parts = [textwrap.fill(part, 16) for part in row.label.split("\n")]
    figure.text(0.008, 0.5 * (low + high), "\n".join(parts), ha="left", va="center", fontsize=8)
