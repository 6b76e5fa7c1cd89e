"""Legends of methods, and legends of several blocks, each with a title."""

from collections.abc import Mapping, Sequence
from typing import Any

from pdrom.view import style
from pdrom.view.artists import Artist, Line2D, SubFigure
from study.figures.kit.options import Drawn

LINE = 0.145  # inches, of a line of text
_GAP = 0.06  # inches, between rows of blocks

Block = tuple[str, Sequence[Artist]]


def _rows(blocks: Sequence[Block], columns: int) -> list[Sequence[Block]]:
    return [blocks[i : i + columns] for i in range(0, len(blocks), columns)]


def legend_height(blocks: Sequence[Block], columns: int) -> float:
    """Height, inches, of the legend of ``blocks`` in ``columns``."""
    rows = _rows(blocks, columns)
    return sum(LINE * (1.3 + max(len(entries) for _, entries in row)) + _GAP for row in rows)


def draw_legend(figure: SubFigure, blocks: Sequence[Block], columns: int) -> None:
    """Draw titled ``blocks`` of entries on ``figure`` in ``columns``, row by row from the top."""
    height = legend_height(blocks, columns)
    top = 1.0
    for row in _rows(blocks, columns):
        for place, (title, entries) in enumerate(row):
            figure.legend(
                handles=list(entries), title=title, loc="upper left", alignment="left",
                bbox_to_anchor=(0.01 + place / columns, top), fontsize=7, title_fontsize=7.5,
                borderpad=0.0, borderaxespad=0.1, labelspacing=0.3, handlelength=1.8,
            )  # fmt: skip
        top -= (LINE * (1.3 + max(len(entries) for _, entries in row)) + _GAP) / height


def method_handles(
    drawn: Drawn, styles: Mapping[str, tuple[str, str]], **common: Any
) -> list[Line2D]:
    """Entries of a legend: methods in their ``styles``, titled by ``drawn``; ``common`` looks."""
    return [
        style.handle(drawn.title(method), color=colour, marker=marker, **common)
        for method, (colour, marker) in styles.items()
    ]
