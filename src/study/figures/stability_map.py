"""Figure of the stability map, which shows the outcome of every reduced run of the study."""

from dataclasses import dataclass
from textwrap import fill

import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact import words
from study.artifact.reads import TableOf
from study.figures.kit.declaration import Drawn, NothingToDraw, figure

RANKS = (6, 10, 20, "full")  # basis sizes; full stands for the numerical rank
ROW = 0.138  # height of a row of cells, inches
SUBSPACES = {"full": "all elements", "ecsw": "sampled elements"}
TITLE = 13  # longest line of the title of a block, characters
GAP = 0.45  # distance between blocks of columns, in widths of a cell
LEAST = 2.0  # smallest width of a block of columns, in widths of a cell: its title must fit


@dataclass(frozen=True)
class Look:
    """Look of the cells with one outcome: cell colour, symbol, colour of the symbol, legend text.

    The outcomes differ in lightness, too. The symbol "frame" stands for the frame of the blow-up.
    """

    face: str
    mark: str
    ink: str
    words: str


LOOKS = {
    "accurate": Look(style.BLUE, "", "white", "error below the limit"),
    "wrong": Look("#F3CB65", "", "black", "finite, error above the limit"),
    "left the scene": Look(style.VERMILLION, "\N{MULTIPLICATION SIGN}", "white", "left the scene"),
    "blow-up": Look("black", "frame", "white", "blow-up (in this frame)"),
    "not run": Look("white", "\N{EN DASH}", "#777777", "not run: exceeds the rank"),
    "not judged": Look("#D9D9D9", "?", "#444444", "not judged: no error before the horizon"),
}


Cells = dict[tuple[str, str], pd.Series]  # column of the map: (scene, group) -> table row


@dataclass(frozen=True)
class Strip:
    """Panel of the stability map.

    rows : (scene, group) -> label
    blocks : title -> neighbouring columns by their labels
    """

    rows: dict[tuple[str, str], str]
    blocks: dict[str, dict[str, Cells]]
    xlabel: str

    def draw(self, ax: Axes) -> set[str]:
        """Draw a cell for each row and column with a run; return the outcomes of these runs."""
        x, ticks, drawn = 0.0, [], set()
        for title, columns in self.blocks.items():
            width = len(columns)
            room = max(0.5 * (LEAST - width), 0.0)
            x += room
            ax.text(x + 0.5 * width, -0.25, title, ha="center", va="bottom", fontsize=7.5)
            for k, cells in enumerate(columns.values()):
                ticks.append(x + k + 0.5)
                for i, key in enumerate(self.rows):
                    if key in cells:
                        _draw_cell(ax, x + k, i, cells[key])
                        drawn.add(str(cells[key].outcome))
            x += width + room + GAP
        ax.set(xlim=(0.0, x - GAP), ylim=(len(self.rows), 0.0))
        texts = [label for columns in self.blocks.values() for label in columns]
        ax.set_xticks(ticks, texts, fontsize=7.5)
        places = [i + 0.5 for i in range(len(self.rows))]
        ax.set_yticks(places, list(self.rows.values()), fontsize=7.5)
        ax.tick_params(length=0, pad=2)
        ax.set_xlabel(self.xlabel, fontsize=7.5)
        ax.spines[:].set_visible(False)
        return drawn


def _draw_cell(ax: Axes, x: float, y: float, found: pd.Series) -> None:
    from matplotlib.patches import Rectangle

    look = LOOKS[str(found.outcome)]
    edge = {"edgecolor": "#BBBBBB", "linewidth": 0.3}
    ax.add_patch(Rectangle((x, y), 1.0, 1.0, facecolor=look.face, **edge))
    mark = f"{int(found.blowup_frame)}" if look.mark == "frame" else look.mark
    if mark:
        ax.text(x + 0.5, y + 0.52, mark, ha="center", va="center", fontsize=7.5, color=look.ink)


@figure(title="Outcome of every reduced simulation", reads={"table": TableOf("stability")})
def stability_map(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Simulations with separate systems for the coordinates (preprint's selection and code) leave
    the scene at nearly every basis size. Simulations with one system, or in position subspaces,
    seldom do. Each cell is a simulation of the training trajectory. The position error, relative to
    the full-order simulation up to the predictability horizon, has the limit {stability.wrong}.
    Left the scene: the bounding box exceeds {stability.left} times the largest bounding box of the
    full-order simulation. Blow-up: positions are not finite in the printed frame. Constraint groups
    whose projections are rounding errors are left out.
    """
    table = table[(table.experiment == "rerun") & (table.group.notna())]
    strips = [_local_strip(table, drawn), _subspace_strip(table, drawn)]
    strips = [strip for strip in strips if strip.rows and strip.blocks]
    if not strips:
        raise NothingToDraw
    rows = [len(strip.rows) for strip in strips]
    figure = style.new_figure(ROW * sum(rows) + 0.5 * len(strips) + 0.55)
    axes = figure.subplots(len(strips), 1, squeeze=False, height_ratios=rows)[:, 0]
    present: set[str] = set()
    for ax, strip in zip(axes, strips, strict=True):
        present |= strip.draw(ax)
    handles = [
        style.patch(
            f"{look.words} ({look.mark})" if look.mark not in ("", "frame") else look.words,
            facecolor=look.face, edgecolor="#BBBBBB", linewidth=0.5,
        )
        for outcome, look in LOOKS.items()
        if outcome in present
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=7.5)
    return figure


def _local_strip(table: pd.DataFrame, drawn: Drawn) -> Strip:
    part = table[table.position_basis == "full"]
    ran = part[part.outcome != "not run"]
    held = set(zip(ran.scene, ran.group, strict=True))
    keys = {(each.scene, each.group): each.title for each in drawn.experiments}
    rows = {key: title for key, title in keys.items() if key in held}
    ranks = [r for r in RANKS if r == "full" or r in set(part.r)]
    largest = ran.sort_values("r", kind="stable").groupby(["scene", "group", "method"]).tail(1)
    blocks = {}
    for method in dict.fromkeys(part.method):
        title = fill(drawn.title(method), TITLE)
        own, whole = (rows_of[rows_of.method == method] for rows_of in (part, largest))
        blocks[title] = {str(r): _cells(whole if r == "full" else own[own.r == r]) for r in ranks}
    return Strip(rows, blocks, "number of modes r (full: numerical rank)")


def _subspace_strip(table: pd.DataFrame, drawn: Drawn) -> Strip:
    part = table[table.position_basis != "full"]
    rows = {(scene, "all"): words.scene(scene) for scene in dict.fromkeys(part.scene)}
    blocks = {}
    for basis, method in dict.fromkeys(zip(part.position_basis, part.method, strict=True)):
        own = part[(part.position_basis == basis) & (part.method == method)]
        title = SUBSPACES.get(method.partition("-")[0]) or drawn.title(method)
        title = fill(f"{basis.replace('pod', 'POD')}, {title}", TITLE)
        sizes = sorted(own.k.dropna().unique())
        blocks[title] = {str(int(k)): _cells(own[own.k == k]) for k in sizes}
    return Strip(rows, blocks, "number of modes k of the position subspace")


def _cells(rows: pd.DataFrame) -> Cells:
    return {(row.scene, row.group): row for _, row in rows.iterrows()}
