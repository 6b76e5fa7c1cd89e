"""Cells that say how a run ended, and their legend: shared by the figures of the stability map."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure

GAP = 0.45  # between blocks, in cells
LEAST = 2.0  # cells, that a title needs
DENSE = 30  # cells across, from which on labels stand upright and titles take two lines


@dataclass(frozen=True)
class Look:
    """Face colour, mark in the cell and its colour, words of the legend.

    The classes differ in lightness, too, and those of failures carry a mark, so that they can be
    told apart without colour. A blow-up carries its frame.
    """

    face: str
    mark: str
    ink: str
    words: str


LOOKS = {
    "accurate": Look(style.BLUE, "", "white", "finite and accurate"),
    "wrong": Look("#F3CB65", "", "black", "finite but wrong"),
    "left the scene": Look(style.VERMILLION, "\N{MULTIPLICATION SIGN}", "white", "left the scene"),
    "blow-up": Look("black", "frame", "white", "blow-up (in this frame)"),
    "not run": Look("white", "\N{EN DASH}", "#777777", "not run: beyond the rank"),
    "not judged": Look("#D9D9D9", "?", "#444444", "not judged: no error within the horizon"),
}


@dataclass(frozen=True)
class Block:
    """Neighbouring columns under one title; ``labels`` name them."""

    title: str
    labels: Sequence[str]


def draw_cells(
    ax: Axes,
    rows: Sequence[str],
    blocks: Sequence[Block],
    cell: Callable[[int, int, int], pd.Series | None],
) -> None:
    """Draw on ``ax`` a cell for each row and each column of each of ``blocks``.

    Parameters
    ----------
    rows : labels, from top to bottom
    cell : (row, block, column) -> row of the table with ``outcome`` and ``blowup_frame``, or None
        for a cell that stays empty
    """
    x, ticks, labels = 0.0, [], []
    dense = sum(len(block.labels) for block in blocks) > DENSE
    for j, block in enumerate(blocks):
        width = len(block.labels)
        title = block.title.replace("-", "-\n", 1) if dense else block.title
        room = max(0.5 * (LEAST - width), 0.0)
        x += room
        ax.text(x + 0.5 * width, -0.25, title, ha="center", va="bottom", fontsize=6.5)
        for k, label in enumerate(block.labels):
            ticks.append(x + k + 0.5)
            labels.append(label)
            for i in range(len(rows)):
                found = cell(i, j, k)
                if found is not None:
                    _draw_cell(ax, x + k, i, found)
        x += width + room + GAP
    ax.set_xlim(0.0, x - GAP)
    ax.set_ylim(len(rows), 0.0)
    ax.set_xticks(ticks, labels, fontsize=6, rotation=90 if dense else 0)
    ax.set_yticks([i + 0.5 for i in range(len(rows))], rows, fontsize=6.5)
    ax.tick_params(length=0, pad=2)
    for spine in ax.spines.values():
        spine.set_visible(False)


def _draw_cell(ax: Axes, x: float, y: float, found: pd.Series) -> None:
    from matplotlib.patches import Rectangle

    look = LOOKS[str(found.outcome)]
    ax.add_patch(
        Rectangle((x, y), 1.0, 1.0, facecolor=look.face, edgecolor="#BBBBBB", linewidth=0.3)
    )
    mark = f"{int(found.blowup_frame)}" if look.mark == "frame" else look.mark
    if mark:
        ax.text(x + 0.5, y + 0.52, mark, ha="center", va="center", fontsize=6, color=look.ink)


def legend(figure: Figure, present: Sequence[str]) -> None:
    """Legend on ``figure`` of the outcomes ``present``."""
    handles = [
        style.patch(_label(look), facecolor=look.face, edgecolor="#BBBBBB", linewidth=0.5)
        for outcome, look in LOOKS.items()
        if outcome in present
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=7)


def _label(look: Look) -> str:
    marked = look.mark and look.mark != "frame"
    return f"{look.words} ({look.mark})" if marked else look.words
