"""The stability map: how every reduced run of the study ended."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact.reads import Settings, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, Experiments, Methods, NothingToDraw, Ranks

CELLS = 48  # of one strip; more blocks make another strip
ROW = 0.145  # inches
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


class Options(Experiments, Methods, Ranks):
    """Options of the figure."""


@figure(
    title="Where each method can be trusted",
    caption=(
        "How every run on the training motion ended, by method, size and scene. Accurate or "
        "wrong: the error within the horizon is at most, or above, {stability.wrong}; left the "
        "scene: the bounding box exceeds {stability.left} times the largest one of the full-order "
        "run; blow-up: numbers that are not finite, or an extent beyond the limit, in the printed "
        "frame. Groups whose projections are round-off are left out."
    ),
    reads={"drawn": Settings(Drawn), "table": TableOf("stability")},
    options=Options,
)
def stability_map(options: Options, drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Draw strips of blocks: a block per method, its columns are sizes; a row per experiment.

    Runs with unreduced positions come first, then those in position subspaces. Experiments in which
    nothing ran, because their projections are round-off, are left out.
    """
    table = options.rows(table)
    table = table[(table.experiment == "rerun") & (table.group.notna())]
    strips = _local_strips(table, drawn, options) + _subspace_strips(table)
    if not strips:
        raise NothingToDraw("no reduced run")
    rows = [len(strip.rows) for strip in strips]
    figure = style.new_figure(ROW * sum(rows) + 0.5 * len(strips) + 0.55)
    axes = figure.subplots(len(strips), 1, squeeze=False, height_ratios=rows)[:, 0]
    for ax, strip in zip(axes, strips, strict=True):
        draw_cells(ax, list(strip.rows.values()), strip.blocks, cell=strip.cell)
        ax.set_xlabel(strip.xlabel, fontsize=7)
        ax.set_ylabel("scene", fontsize=7)
    legend(figure, list({o for strip in strips for o in strip.outcomes()}))
    return figure


@dataclass(frozen=True)
class _Strip:
    """A strip of the map: blocks of columns side by side that share their rows.

    rows : (scene, group) -> label
    lookups : for each block the (scene, group) -> rows of the table, by column
    """

    rows: dict[tuple[str, str], str]
    blocks: list[Block]
    lookups: list[list[dict[tuple[str, str], pd.Series]]]
    xlabel: str

    def cell(self, row: int, block: int, column: int) -> pd.Series | None:
        """Row of the table for a cell."""
        return self.lookups[block][column].get(list(self.rows)[row])

    def outcomes(self) -> set[str]:
        """Outcomes that occur."""
        found = [column.get(key) for block in self.lookups for column in block for key in self.rows]
        return {str(cell.outcome) for cell in found if cell is not None}


def _local_strips(table: pd.DataFrame, drawn: Drawn, options: Options) -> list[_Strip]:
    part = table[table.position_basis == "full"]
    ran = part[part.outcome != "not run"]
    held = set(zip(ran.scene, ran.group, strict=True))
    keys = {(each.scene, each.group): each.title for each in drawn.experiments}
    rows = {key: title for key, title in keys.items() if key in held}
    ranks = [r for r in options.ranks if r == "full" or r in set(part.r)]
    blocks, lookups = [], []
    for method in dict.fromkeys(part.method):
        own = part[part.method == method]
        blocks.append(Block(method, [str(r) for r in ranks]))
        lookups.append([_by_experiment(_at_size(own, r)) for r in ranks])
    return _wrapped(rows, blocks, lookups, "number of modes r (full: numerical rank)")


def _subspace_strips(table: pd.DataFrame) -> list[_Strip]:
    part = table[table.position_basis != "full"]
    rows = {(scene, "all"): style.words(scene) for scene in dict.fromkeys(part.scene)}
    blocks, lookups = [], []
    for basis, method in dict.fromkeys(zip(part.position_basis, part.method, strict=True)):
        own = part[(part.position_basis == basis) & (part.method == method)]
        sizes = sorted(own.k.dropna().unique())
        sampled = "all" if method == "full" else method
        blocks.append(Block(f"{basis}\n{sampled}", [str(int(k)) for k in sizes]))
        lookups.append([_by_experiment(own[own.k == k]) for k in sizes])
    return _wrapped(
        rows, blocks, lookups, "number of modes k of the position subspace (all: all projections)"
    )


def _wrapped(rows: dict, blocks: list[Block], lookups: list, xlabel: str) -> list[_Strip]:
    """Strips of at most `CELLS` cells."""
    if not rows or not blocks:
        return []
    strips, start, used = [], 0, 0
    for i, block in enumerate(blocks):
        if used and used + len(block.labels) > CELLS:
            strips.append(_Strip(rows, blocks[start:i], lookups[start:i], xlabel))
            start, used = i, 0
        used += len(block.labels)
    return [*strips, _Strip(rows, blocks[start:], lookups[start:], xlabel)]


def _at_size(rows: pd.DataFrame, size: int | str) -> pd.DataFrame:
    """Runs of a size; "full" is the largest one that ran in each experiment."""
    if size != "full":
        return rows[rows.r == size]
    ran = rows[rows.outcome != "not run"].sort_values("r", kind="stable")
    return ran.groupby(["scene", "group"], sort=False).tail(1)


def _by_experiment(rows: pd.DataFrame) -> dict[tuple[str, str], pd.Series]:
    return {(row.scene, row.group): row for _, row in rows.iterrows()}
