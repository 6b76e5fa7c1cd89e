"""Accuracy of reduced models against their time per frame, by family and constraint group."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Artist, Axes, Figure, Line2D, SubFigure
from pdrom.view.multiples import clipped, label_counts, log_axis, time_axis
from study.artifact.reads import Settings, TableOf
from study.experiments.kit.settings import ANDERSON, FOM
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, Methods, Scenes
from study.tables.accuracy_cost import FEWER, pareto

LINE = 0.145  # inches, of a line of text
GAP = 0.06  # inches, between rows of blocks

Block = tuple[str, Sequence[Artist]]
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")
ERROR, TIME = "relative_error_within_horizon", "ms_per_frame"
LOW, HIGH = 1e-4, 1e2  # errors outside are arrows on the rim
ABOVE, BELOW, BLOWN_UP = 6, 7, "x"  # markers: carets, and a cross
OWN = {"color": style.GREY, "linewidth": 1.2}
BLIND = {"color": style.FAILED, "linewidth": 0.9, "linestyle": "-."}
RATES = (60, 30)  # frames per second
LARGE, SMALL = 2.6, 1.6  # inches, heights of panels
LOWEST = 1e-3  # of the axes: what matters here lies above
COLUMNS = 4  # of the legend


@dataclass(frozen=True)
class Family:
    """Models of one kind, told apart from the others by their colour."""

    title: str
    colour: str


ITERATIONS = Family("full order, fewer iterations", style.BLACK)
PROJECTION = Family("orthogonal projection", style.PURPLE)
ENTRIES = Family("single entries, joint rows", style.VERMILLION)
ELEMENTS = Family("whole elements", style.BLUE)
WEIGHTED = Family("subspace, weighted or full", style.GREEN)
INTERPOLATED = Family("subspace, interpolated", style.ORANGE)
FAMILIES = (ITERATIONS, PROJECTION, ENTRIES, ELEMENTS, WEIGHTED, INTERPOLATED)
_BY_ROWS = {"all": PROJECTION, "scalar": ENTRIES, "joint": ENTRIES, "element": ELEMENTS}


@dataclass(frozen=True)
class Model:
    """A method with the kind of position basis that it is used in (``full`` for none)."""

    method: str
    position_basis: str

    @property
    def hollow(self) -> bool:
        """Whether its markers are hollow: its position basis is that of skinning."""
        return self.position_basis == "skinning"

    def title(self, drawn: Drawn) -> str:
        """Name within its family, which models share that differ by tolerance or basis only.

        Titles of methods are those of ``drawn``.
        """
        if self.position_basis == "full":
            return drawn.title(self.method)
        if self.method == "full":
            return "all projections"
        return "ecsw, by tolerance" if self.method.startswith("ecsw") else self.method

    def family(self, drawn: Drawn) -> Family | None:
        """Family of the model of those ``drawn``; None for a method that is not drawn."""
        if self.method == FEWER:
            return ITERATIONS
        if self.position_basis != "full":
            weighted = self.method == "full" or self.method.startswith("ecsw")
            return WEIGHTED if weighted else INTERPOLATED
        held = drawn.reductions.get(self.method)
        return _BY_ROWS[held.rows] if held else None


def markers(models: Sequence[Model], drawn: Drawn) -> dict[Model, str]:
    """A marker for each title of ``models`` within a family, in their order, of those ``drawn``."""
    found: dict[Model, str] = {}
    for family in FAMILIES[1:]:
        members = [model for model in models if model.family(drawn) == family]
        titles = list(dict.fromkeys(model.title(drawn) for model in members))
        for model in members:
            found[model] = MARKERS[titles.index(model.title(drawn)) % len(MARKERS)]
    return found


@dataclass(frozen=True)
class TradeOffs:
    """Points of every scene.

    points : rows of the table accuracy_cost whose errors are against the scene's own run
    blown_up : reduced runs that ended before they had an error
    own_ms : scene -> time per frame of its own full-order run
    own_error : scene -> that run's own error, against the converged one
    """

    drawn: Drawn
    points: pd.DataFrame
    blown_up: pd.DataFrame
    own_ms: dict[str, float]
    own_error: dict[str, float]
    marker: dict[Model, str]

    def models(self, family: Family) -> list[Model]:
        """Models of a ``family``, in the order of the table."""
        return [model for model in self.marker if model.family(self.drawn) == family]


def trade_offs(
    drawn: Drawn, table: pd.DataFrame, runs: pd.DataFrame
) -> tuple[TradeOffs, list[str]]:
    """Points of the scenes and methods ``drawn``, and these scenes.

    Parameters
    ----------
    table, runs : the tables accuracy_cost and reduced_reruns

    Raises
    ------
    NothingToDraw
        No reduced model has both an error and a time.
    """
    table = table.dropna(subset=[ERROR, TIME])
    own = (table.method == "full") & (table.position_basis == "full")
    full = table[own].set_index("scene")
    fom = table[table.method == FOM].set_index(["scene", "iterations"])[ERROR]
    errors = {s: float(fom[s, k]) for s, k in full.iterations.items() if (s, k) in fom}
    shown = (table[TIME] > 0.0) & ~own & ~table.method.isin([FOM, ANDERSON])
    points = _drawn(table[shown], drawn)
    blown_up = runs[(runs.blowup_frame >= 0) & runs[ERROR].isna() & (runs[TIME] > 0.0)]
    scenes = drawn.scenes_of(points, "no reduced model with both an error and a time")
    points = points[points.scene.isin(scenes)]
    names = dict.fromkeys(zip(points.method, points.position_basis, strict=True))
    marker = markers([Model(*name) for name in names if name[0] != FEWER], drawn)
    found = TradeOffs(drawn, points, _drawn(blown_up, drawn), dict(full[TIME]), errors, marker)
    return found, scenes


def _drawn(table: pd.DataFrame, drawn: Drawn) -> pd.DataFrame:
    """Rows of models that are drawn, with their family."""
    names = zip(table.method, table.position_basis, strict=True)
    families = [Model(*name).family(drawn) for name in names]
    kept = np.array([family is not None for family in families], dtype=bool)
    return table[kept].assign(family=[family.title for family in families if family])


def draw_panel(ax: Axes, found: TradeOffs, scene: str, low: float = LOW, size: float = 3.0) -> None:
    """Draw a scene's points, the front of each family, and the full-order run that they replace.

    ``ax`` gets those ``found``, with markers of ``size``.

    An error below ``low`` or above `HIGH` is an arrow on the rim; a run that blew up, a cross on
    the upper one.
    """
    ax.set_xscale("log")
    log_axis(ax, low, HIGH)
    rows = found.points[found.points.scene == scene]
    lost = found.blown_up[found.blown_up.scene == scene]
    for family in FAMILIES:
        part = rows[rows.family == family.title]
        for model in found.models(family):
            own = (part.method == model.method) & (part.position_basis == model.position_basis)
            fill = "none" if model.hollow else "full"
            _points(ax, part[own], family.colour, found.marker[model], low, size, fill)
        if family == ITERATIONS:
            _points(ax, part, family.colour, "X", low, size)
        _front(ax, part, family.colour, low)
        ended = lost[lost.family == family.title]
        ax.plot(
            ended[TIME], np.full(len(ended), 0.6 * HIGH), BLOWN_UP, color=family.colour,
            markersize=6.0, markeredgewidth=1.8,
        )  # fmt: skip
    times = [*rows[TIME], *lost[TIME], found.own_ms.get(scene, np.nan)]
    time_axis(ax, np.asarray(times, dtype=float))
    if scene in found.own_ms:
        ax.axvline(found.own_ms[scene], zorder=0, **OWN)
    if scene in found.own_error:
        ax.axhline(np.clip(found.own_error[scene], low, HIGH), zorder=0, **BLIND)


def _points(
    ax: Axes,
    rows: pd.DataFrame,
    colour: str,
    marker: str,
    low: float,
    size: float,
    fill: Literal["full", "none"] = "full",
) -> None:
    error, time = rows[ERROR].to_numpy(float), rows[TIME].to_numpy(float)
    looks = ((error < low, BELOW), (error > HIGH, ABOVE))
    inside = (error >= low) & (error <= HIGH)
    common = {"linestyle": "none", "color": colour, "alpha": 0.75, "markeredgewidth": 0.9}
    ax.plot(time[inside], error[inside], marker=marker, markersize=size, fillstyle=fill, **common)
    for outside, arrow in looks:
        if outside.any():
            rim = clipped(error[outside], low, HIGH)
            ax.plot(time[outside], rim, marker=arrow, markersize=size + 2.5, **common)


def _front(ax: Axes, rows: pd.DataFrame, colour: str, low: float) -> None:
    unbeaten = np.array(pareto(rows[ERROR].to_list(), rows[TIME].to_list()), dtype=bool)
    best = rows[unbeaten].sort_values(TIME)
    heights = clipped(best[ERROR].to_numpy(float), low, HIGH)
    ax.plot(best[TIME], heights, color=colour, linewidth=1.3, drawstyle="steps-post", zorder=1.5)


def label_iterations(ax: Axes, found: TradeOffs, scene: str) -> None:
    """Write the number of iterations beside each run of ``scene`` that stops earlier.

    ``ax`` shows those ``found``; near ones share a label.
    """
    rows = found.points[(found.points.scene == scene) & (found.points.method == FEWER)]
    rows = rows.sort_values(TIME)
    label_counts(ax, rows[TIME], rows[ERROR], counts=rows.iterations, prefix="K = ")


def group_title(drawn: Drawn, scene: str) -> str:
    """Constraint group that ``scene`` of ``drawn`` reduces, in words."""
    groups = [each.group for each in drawn.of(scene)]
    return style.words(groups[0]) if len(groups) == 1 else "several groups"


def handles(found: TradeOffs) -> list[tuple[str, list[Line2D]]]:
    """Legend entries of those ``found`` by family: a colour, a marker a title."""
    common = {"linewidth": 1.0, "markersize": 4.0}
    entries = [
        ("full order", [
            style.handle("K iterations", color=ITERATIONS.colour, marker="X", **common),
            style.handle("its time", **OWN),
            style.handle("its own error", **BLIND),
        ]),
    ]  # fmt: skip
    for family in FAMILIES[1:]:
        marker = {m.title(found.drawn): found.marker[m] for m in found.models(family)}
        members = [
            style.handle(title, color=family.colour, marker=shape, **common)
            for title, shape in marker.items()
        ]
        if members:
            entries.append((family.title, members))
    return entries


class Options(Scenes, Methods):
    """Options of the figure; the first scene is drawn large."""


@figure(
    title="What accuracy costs in time",
    caption=(
        "Error within the horizon against the time per frame of every reduced model, and of the "
        "full-order run with fewer iterations $K$; both against the scene's own full-order run, "
        "whose time is the vertical line. A colour is a family of models, a marker one of its "
        "members (one for all tolerances; hollow: in a subspace of skinning weights), a line the "
        "best trade-offs within the family: further down and further left is better. "
        "The horizontal line is the full-order run's own error, against the converged one: "
        "errors below it cannot be seen. Arrows on the rim are errors outside the axis, crosses "
        "runs that blew up. Below, a scene for each other constraint group."
    ),
    reads={
        "drawn": Settings(Drawn),
        "table": TableOf("accuracy_cost"),
        "runs": TableOf("reduced_reruns"),
    },
    options=Options,
)
def accuracy_cost(
    options: Options, drawn: Drawn, table: pd.DataFrame, runs: pd.DataFrame
) -> Figure:
    """Draw the first scene large; below it one scene for each other group, the next in order."""
    found, scenes = trade_offs(drawn, table, runs)
    first, *rest = scenes
    small = list({group_title(drawn, scene): scene for scene in reversed(rest)}.values())[::-1]
    blocks = handles(found)
    heights = [LARGE, *([SMALL] if small else []), legend_height(blocks, COLUMNS)]
    figure = style.new_figure(sum(heights))
    parts = figure.subfigures(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
    ax = parts[0].subplots()
    draw_panel(ax, found, first, low=LOWEST, size=4.2)
    label_iterations(ax, found, first)
    _draw_rates(ax)
    ax.set_title(f"{group_title(drawn, first)}: {style.words(first)}")
    ax.set(xlabel="time per frame (ms)", ylabel="relative error")
    if small:
        axes = parts[1].subplots(1, len(small), sharey=True, squeeze=False)[0]
        _draw_small(axes, found, small)
    draw_legend(parts[-1], blocks, COLUMNS)
    return figure


def _draw_small(axes: np.ndarray, found: TradeOffs, scenes: list[str]) -> None:
    for ax, scene in zip(axes, scenes, strict=True):
        draw_panel(ax, found, scene, low=LOWEST, size=2.4)
        ax.set_title(f"{group_title(found.drawn, scene)}:\n{style.words(scene)}")
        ax.set_xlabel("time per frame (ms)")
    axes[0].set_ylabel("relative error")


def _draw_rates(ax: Axes) -> None:
    """Lines of real time, where the axis reaches them; otherwise they are named at its side."""
    high = ax.get_xlim()[1]
    beyond = [rate for rate in RATES if 1e3 / rate >= high]
    for rate in set(RATES) - set(beyond):
        ax.axvline(1e3 / rate, color="#8A857A", linewidth=0.8, linestyle="--", zorder=0)
        _label(ax, 1e3 / rate, f"{rate} fps ")
    if beyond:
        names = ", ".join(str(rate) for rate in beyond)
        _label(ax, high, f"{names} fps \N{RIGHTWARDS ARROW}")


def _label(ax: Axes, x: float, text: str) -> None:
    ax.text(
        x, 0.99, text, transform=ax.get_xaxis_transform(), fontsize=6.5, va="top", ha="right",
        color="#6B675F",
    )  # fmt: skip


def _rows(blocks: Sequence[Block], columns: int) -> list[Sequence[Block]]:
    return [blocks[i : i + columns] for i in range(0, len(blocks), columns)]


def legend_height(blocks: Sequence[Block], columns: int) -> float:
    """Height, inches, of the legend of ``blocks`` in ``columns``."""
    rows = _rows(blocks, columns)
    return sum(LINE * (1.3 + max(len(entries) for _, entries in row)) + GAP for row in rows)


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
        top -= (LINE * (1.3 + max(len(entries) for _, entries in row)) + GAP) / height
