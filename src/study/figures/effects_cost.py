"""Cost of each effect of a scene; an absent one costs nothing."""

import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact.reads import Settings, TableOf
from study.experiments.kit.names import GLOBAL, REST, RIGHT
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, Scenes
from study.tables.effects_cost import NOTHING

OTHERS = "forces, holds, contacts"
COLOURS = {OTHERS: style.VERMILLION, RIGHT: style.SKY, GLOBAL: "#3A5A78", REST: "#C9C4BA"}


@figure(
    title="What each effect costs",
    caption=(
        "Left: share of each effect in the time of a full-order frame, which is printed beside "
        "the bar. Right: the frame of one scene built without some of its effects; the tick is "
        "the whole less what these effects cost in it. A bar that ends at the tick pays nothing "
        "for what the scene does not list."
    ),
    reads={"drawn": Settings(Drawn), "table": TableOf("effects_cost")},
    options=Scenes,
)
def effects_cost(options: Scenes, drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Draw a bar per scene, divided by effect; on the right one scene without some of its effects.

    On the right a tick marks the time of the whole scene less what the missing effects cost in it.
    A bar that ends there pays nothing for what it does not list.
    """
    costs, removed = table.dropna(subset=["share"]), table.dropna(subset=["without_ms"])
    removed = removed.sort_values("effect", key=lambda name: name != NOTHING, kind="stable")
    scenes = drawn.scenes_of(costs, "no timings of effects")
    several = [scene for scene in scenes if (removed.scene == scene).any()]
    rows = removed[removed.scene == several[0]] if several else removed[:0]
    height = 0.27 * max(len(scenes), len(rows)) + 1.3
    figure = style.new_figure(height)
    axes = figure.subplots(1, 2 if several else 1, squeeze=False)[0]
    looks = drawn.looks
    colours = {**{group: colour for group, (colour, _) in looks.items()}, **COLOURS}
    parts = _draw_scenes(axes[0], costs, scenes, colours)
    handles: list = [style.patch(style.words(part), color=colours[part]) for part in parts]
    if several:
        _draw_left_out(axes[1], rows, several[0])
        tick = {"linestyle": "none", "marker": "|", "markersize": 9, "markeredgewidth": 1.4}
        handles.append(style.handle("whole less its own cost", color=style.BLACK, **tick))
    style.legend(figure, handles, 4)
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
    style.label_rows(ax, [style.words(scene) for scene in scenes])
    ax.set_xlim(0, 100)
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel("share of a full-order frame (%)")
    ax.set_ylabel("scene")
    return parts


def _draw_left_out(ax: Axes, rows: pd.DataFrame, scene: str) -> None:
    whole = float(rows.without_ms.iloc[0])
    shades = {1: "#BFD3E0", 2: "#8FB2C9", 3: "#5F90B2"}
    for y, row in enumerate(rows.itertuples()):
        ax.barh(y, row.without_ms, color=shades.get(row.groups, "#5F90B2"), height=0.72)
        if row.ms_per_frame > 0.0:
            ax.plot(
                [whole - row.ms_per_frame], [y], marker="|", color=style.BLACK, markersize=9,
                markeredgewidth=1.4,
            )  # fmt: skip
    style.label_rows(ax, [_words(row.effect) for row in rows.itertuples()])
    ax.set_xlim(0.0, 1.15 * float(rows.without_ms.max()))
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel("time per frame (ms)")
    ax.set_title(style.words(scene))


def _words(left_out: str) -> str:
    return "whole" if left_out == NOTHING else f"without {style.words(left_out)}"
