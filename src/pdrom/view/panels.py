"""Panels that show the mesh of a run in one frame or a message; figures of rows of panels."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from pdrom.model.mesh.types import Mesh
from pdrom.view import mesh_render, style
from pdrom.view.artists import Axes, Figure
from pdrom.view.camera import Camera, Window, bounds, window_of
from pdrom.view.style import FAILED

SAME_SCALE = 1.25  # runs that would enlarge the reference run's picture by more are drawn smaller
SLACK = 1.05  # a run drawn smaller by at most this factor gets no remark about its scale
SHORTEST, TALLEST = 0.35, 1.5  # least and largest ratio of height to width of a panel


@dataclass(frozen=True)
class RunPanel:
    """Picture of one run in one frame.

    colour : one colour, or RGB colours (T, 3) of the triangles, which then represent numbers
    positions : (N, 3) m, finite; None if there is nothing to draw
    failure : reason of the failure, drawn in red; None for a run without failure
    remark : one line below the picture
    reference : whether this is the run with which the other runs are compared
    obstacles : surfaces of the obstacles; None draws the floor y = 0
    cropped : whether parts outside the window are cut off, instead of drawing the run smaller
    """

    title: str
    colour: mesh_render.Colour | np.ndarray
    positions: np.ndarray | None
    failure: str | None = None
    remark: str | None = None
    reference: bool = False
    obstacles: Sequence[Mesh] | None = None
    cropped: bool = False

    @property
    def began(self) -> bool:
        """Whether there was a run: it is drawn, or has failed."""
        return self.positions is not None or self.failure is not None

    def zoomed(self, window: Window, camera: Camera) -> Window:
        """Return ``window``, enlarged in both directions if ``camera`` sees the run exceed it."""
        flat = None if self.positions is None else camera.project(self.positions)
        if flat is None or self.cropped or window.contains(flat).all():
            return window
        corners = [(window.left, window.bottom), (window.right, window.top)]
        both = bounds(np.concatenate([flat, corners]), 0.03)
        factor = max(both.width / window.width, both.height / window.height)
        return both.resized(factor * window.width, factor * window.height)


def shared_window(
    camera: Camera, reference: np.ndarray, panels: list[RunPanel], margin: float = 0.1
) -> Window:
    """Return a window for ``reference`` (N, 3) m and runs up to `SAME_SCALE` times as large."""
    base = window_of(camera, [reference], margin)
    size = SAME_SCALE * max(base.width, base.height)
    clouds = [reference]
    for panel in panels:
        if panel.positions is None or panel.failure:
            continue
        own = window_of(camera, [reference, panel.positions], margin)
        if max(own.width, own.height) <= size:
            clouds.append(panel.positions)
    return fit_aspect(window_of(camera, clouds, margin))


def fit_aspect(window: Window) -> Window:
    """Enlarge ``window`` in one direction until height / width is in [`SHORTEST`, `TALLEST`]."""
    height = np.clip(window.height, SHORTEST * window.width, None)
    width = max(window.width, height / TALLEST)
    return window.resized(width, height)


def draw_run(ax: Axes, row: "Row", i: int) -> None:
    """Draw panel ``i`` of a ``row`` on ``ax``, at a smaller scale if its run exceeds its window."""
    from matplotlib.collections import LineCollection

    mesh, panel, camera, window = row.mesh, row.panels[i], row.camera, row.windows[i]
    ax.set_title(panel.title, pad=3, fontsize=7.5)
    if panel.failure:
        look = {"facecolor": "#FBEDEB", "edgecolor": "#EBB9B4", "hatch": "////", "linewidth": 0.0}
        _cover(ax, zorder=-5, **look)
    if panel.positions is None:
        mesh_render.set_window(ax, window)
        note = panel.failure or panel.remark or ""
        centre_note(ax, note, FAILED if panel.failure else "#666666")
        return
    shown = panel.zoomed(window, camera)
    zoom = shown.width / window.width  # factor by which the run is drawn smaller to fit
    for body in panel.obstacles or ():
        look = {"colour": mesh_render.FLOOR, "wire": 0.05}
        mesh_render.draw_surface(ax, body.points, body, camera, **look).set_zorder(0.1)
    if panel.obstacles is None and not panel.failure:
        mesh_render.draw_floor(ax, panel.positions, mesh, camera, shown)
    if not panel.reference:
        ghost = row.ghosts[i]
        edges = mesh_render.outline_edges(mesh.points, ghost, mesh.triangles, camera)
        flat = camera.project(ghost)[edges]
        lines = LineCollection(flat, colors=mesh_render.GHOST, linewidths=0.6, zorder=0.5)
        ax.add_collection(lines)
    contrast = 0.5 if isinstance(panel.colour, np.ndarray) else 1.0
    mesh_render.draw_surface(ax, panel.positions, mesh, camera, panel.colour, contrast=contrast)
    mesh_render.set_window(ax, shown)
    texts = [text for text in (panel.failure, panel.remark) if text]
    if zoom > SLACK:
        texts.append(f"scale 1 : {zoom:.{1 if zoom < 10.0 else 0}f}")
        # a red border: this picture has another scale than its neighbours
        _cover(ax, zorder=8, facecolor="none", edgecolor=FAILED, linewidth=0.6)
    if texts:
        colour = FAILED if panel.failure or zoom > SLACK else "#555555"
        ax.set_xlabel("\n".join(texts), color=colour, fontsize=7.5, labelpad=2)


def _cover(ax: Axes, **look: Any) -> None:
    from matplotlib.patches import Rectangle

    ax.add_patch(Rectangle((0, 0), 1, 1, transform=ax.transAxes, clip_on=False, **look))


def centre_note(ax: Axes, text: str, colour: str = "#666666") -> None:
    """Write boxed ``text`` of a ``colour`` in the middle of a panel ``ax``."""
    box = {"boxstyle": "round,pad=0.4", "facecolor": "white", "edgecolor": colour, "lw": 0.6}
    ax.text(
        0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center",
        color=colour, fontsize=7.5, bbox=box,
    )  # fmt: skip


ROW_LIMIT = 1.2  # inches, so that a page has space for six rows and their caption
LEFT = 1.0  # inches, width of the row labels
ABOVE, LINE, BELOW = 0.19, 0.13, 0.07  # inches: heights of a title, a text line, a gap


@dataclass(frozen=True)
class Row:
    """Row of n panels, each with a separate window.

    ghosts : (n, N, 3) m, shapes of the reference run, outlined behind the reduced runs
    note : text in place of the reduced runs, for an experiment in which none ran
    """

    label: str
    mesh: Mesh
    panels: list[RunPanel]
    windows: list[Window]
    ghosts: np.ndarray
    camera: Camera
    note: str | None = None

    @property
    def _pictures(self) -> list[tuple[RunPanel, Window]]:
        pairs = zip(self.panels, self.windows, strict=True)
        return [(panel, window) for panel, window in pairs if panel.positions is not None]

    @property
    def aspect(self) -> float:
        """Largest ratio of height to width of the row's pictures; 0.28 without pictures."""
        return max((w.height / w.width for _, w in self._pictures), default=0.28)

    @property
    def lines(self) -> int:
        """Number of lines of text below the pictures."""
        counts = [0]
        for panel, window in self._pictures:
            smaller = panel.zoomed(window, self.camera).width / window.width > SLACK
            counts.append(bool(panel.failure) + bool(panel.remark) + smaller)
        return max(counts)


def draw_rows(rows: list[Row], row_limit: float = ROW_LIMIT, footer: float = 0.0) -> Figure:
    """Draw ``rows``, on average up to ``row_limit`` inches high, above ``footer`` free inches."""
    columns = max(len(row.panels) for row in rows)
    width = (style.WIDTH - LEFT) / columns
    texts = footer + sum(ABOVE + BELOW + LINE * row.lines for row in rows)
    pictures = sum(0.96 * width * row.aspect for row in rows)
    shrink = min(1.0, (row_limit * len(rows) + footer - texts) / pictures)
    heights = [
        shrink * 0.96 * width * row.aspect + ABOVE + BELOW + LINE * row.lines for row in rows
    ]
    height = sum(heights) + footer
    figure = style.new_figure(height, None)
    tops = 1.0 - np.concatenate([[0.0], np.cumsum(heights)]) / height
    for row, (top, bottom) in zip(rows, pairwise(tops), strict=True):
        _draw_row(figure, row, columns, top, bottom)
    return figure


def _draw_row(figure: Figure, row: Row, columns: int, top: float, bottom: float) -> None:
    inch = 1.0 / figure.get_figheight()
    low, high = bottom + (BELOW + LINE * row.lines) * inch, top - ABOVE * inch
    left = LEFT / style.WIDTH
    step = (1.0 - left) / columns
    drawn = [] if row.note and row.panels[0].positions is None else row.panels
    for i in range(len(drawn)):
        ax = figure.add_axes((left + (i + 0.02) * step, low, 0.96 * step, high - low))
        draw_run(ax, row, i)
    if row.note:
        start = left + len(drawn) * step
        ax = figure.add_axes((start, low, 1.0 - start, high - low))
        ax.set_axis_off()
        centre_note(ax, row.note)
    parts = [textwrap.fill(part, 16) for part in row.label.split("\n")]
    figure.text(0.008, 0.5 * (low + high), "\n".join(parts), ha="left", va="center", fontsize=8)
