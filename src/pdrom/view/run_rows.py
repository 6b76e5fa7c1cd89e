"""Rows of panels with runs in them: a full-order run beside reduced ones."""

import textwrap
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pdrom.model.mesh.types import Mesh
from pdrom.view import style
from pdrom.view.artists import Figure
from pdrom.view.camera import Camera, Window
from pdrom.view.panels import SLACK, RunPanel, centre_note, draw_run
from pdrom.view.read import RerunInfo, rerun_positions

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


def run_panel(
    path: str,
    info: RerunInfo,
    frame: int,
    colour: tuple[float, float, float],
    title: str,
) -> RunPanel:
    """Panel of a reduced run at ``frame``; what it says about a run that failed or never began.

    The run is ``info`` in the file ``path``; ``colour`` and ``title`` are those of the panel.
    """
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


def draw_rows(
    rows: list[Row], camera: Camera, height_limit: float = HEIGHT_LIMIT, footer: float = 0.0
) -> Figure:
    """Figure of ``rows``, one below the other, as ``camera`` sees them.

    It is no higher than ``height_limit``, inches; ``footer`` inches at its lower end are left free.
    """
    columns = max(len(row.panels) for row in rows)
    width = (style.WIDTH - LEFT) / columns
    texts = footer + sum(ABOVE + BELOW + LINE * row.lines for row in rows)
    pictures = sum(0.96 * width * row.aspect for row in rows)
    shrink = min(1.0, (height_limit - texts) / pictures)
    heights = [
        shrink * 0.96 * width * row.aspect + ABOVE + BELOW + LINE * row.lines for row in rows
    ]
    height = sum(heights) + footer
    figure = style.new_figure(height, None)
    tops = 1.0 - np.concatenate([[0.0], np.cumsum(heights)]) / height
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
        draw_run(ax, row.mesh, panel, camera=camera, window=row.windows[i], ghost=ghost)
    if row.note:
        start = left + len(drawn) * step
        ax = figure.add_axes((start, low, 1.0 - start, high - low))
        ax.set_axis_off()
        centre_note(ax, row.note)
    parts = [textwrap.fill(part, 16) for part in row.label.split("\n")]
    figure.text(0.008, 0.5 * (low + high), "\n".join(parts), ha="left", va="center", fontsize=8)
