"""What each effect of a scene costs, and that an absent one costs nothing."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pdrom.experiments.kit.names import GLOBAL, REST, RIGHT
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.options import Scenes
from pdrom.report.figures.kit.results import NothingToDraw, Results

COSTS = ["scene", "effect", "ms_per_frame", "share"]
LEFT_OUT = ["scene", "left_out", "groups", "ms_per_frame", "own_ms"]
OTHERS = "forces, holds, contacts"
COLOURS = {OTHERS: style.VERMILLION, RIGHT: style.SKY, GLOBAL: "#3A5A78", REST: "#C9C4BA"}


def draw(results: Results, options: Scenes) -> Figure:
    """Left a bar per scene, divided by effect; right one scene without some of its effects.

    On the right a tick marks the time of the whole scene less what the missing effects cost in it.
    A bar that ends there pays nothing for what it does not list.

    Raises
    ------
    StorageError
        A table is missing or lacks a column.
    """
    costs = results.table("effects_cost", COSTS)
    removed = results.table("effects_left_out", LEFT_OUT)
    held = results.scenes(options)
    scenes = [scene for scene in held if (costs.scene == scene).any()]
    if not scenes:
        raise NothingToDraw("no timings of effects")
    several = [scene for scene in scenes if (removed.scene == scene).any()]
    rows = removed[removed.scene == several[0]] if several else removed[:0]
    height = 0.27 * max(len(scenes), len(rows)) + 1.3
    figure = Figure(figsize=(style.WIDTH, height), layout="constrained")
    axes = figure.subplots(1, 2 if several else 1, squeeze=False)[0]
    looks = style.group_looks(results.holdings)
    colours = {**{group: colour for group, (colour, _) in looks.items()}, **COLOURS}
    parts = _draw_scenes(axes[0], costs, scenes, colours)
    handles: list = [Patch(color=colours[part], label=style.words(part)) for part in parts]
    if several:
        _draw_left_out(axes[1], rows, several[0])
        tick = {"linestyle": "none", "marker": "|", "markersize": 9, "markeredgewidth": 1.4}
        handles.append(Line2D([], [], color=style.BLACK, label="whole less its own cost", **tick))
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _draw_scenes(
    ax: Axes, costs: pd.DataFrame, scenes: list[str], colours: dict[str, str]
) -> list[str]:
    """Bars of shares; returns the parts that were drawn, in the order of the legend."""
    costs = costs.assign(part=costs.effect.where(costs.effect.isin(list(colours)), OTHERS))
    parts = [part for part in colours if (costs.part == part).any()]
    for y, scene in enumerate(scenes):
        rows = costs[costs.scene == scene]
        start = 0.0
        for part, share in (100.0 * rows.groupby("part").share.sum()).reindex(parts).items():
            if share > 0.0:
                ax.barh(y, share, left=start, color=colours[str(part)], height=0.72)
                start += share
        total = rows.ms_per_frame.sum()
        ax.text(101.0, y, f"{total:.2g} ms", va="center", ha="left", fontsize=7)
    ax.set_yticks(range(len(scenes)), [style.words(scene) for scene in scenes])
    ax.set_ylim(len(scenes) - 0.4, -0.6)
    ax.set_xlim(0, 100)
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel("share of a full-order frame (%)")
    ax.set_ylabel("scene")
    return parts


def _draw_left_out(ax: Axes, rows: pd.DataFrame, scene: str) -> None:
    whole = float(rows.ms_per_frame.iloc[0])
    shades = {1: "#BFD3E0", 2: "#8FB2C9", 3: "#5F90B2"}
    for y, row in enumerate(rows.itertuples()):
        ax.barh(y, row.ms_per_frame, color=shades.get(row.groups, "#5F90B2"), height=0.72)
        if row.own_ms > 0.0:
            ax.plot(
                [whole - row.own_ms], [y], marker="|", color=style.BLACK, markersize=9,
                markeredgewidth=1.4,
            )  # fmt: skip
    labels = [_words(row.left_out) for row in rows.itertuples()]
    ax.set_yticks(range(len(rows)), labels)
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.set_xlim(0.0, 1.15 * float(rows.ms_per_frame.max()))
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel("time per frame (ms)")
    ax.set_title(style.words(scene))


def _words(left_out: str) -> str:
    return "whole" if left_out == "nothing" else f"without {style.words(left_out)}"
