"""Effects of a scene: what each contributes to its run, and what it costs."""

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact.paths import CONTRIBUTIONS, File
from study.artifact.reads import EachOf, Settings, TableOf
from study.experiments.kit.settings import GLOBAL, REST, RIGHT
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, Scenes
from study.tables.effects_cost import NOTHING

FRAMES = ["effect", "frame", "force"]
SHOWN = 3  # scenes whose forces are drawn
LOW, HIGH = 1e-12, 1e2
ROUNDOFF = 1e-14  # of the largest force of a scene: what is smaller is not drawn
OTHERS = ("#8C6D31", "#5A5A5A", "#B03A6B", "#2B2B80", "#3E8E7E", "#A0522D", "#7F7F00")
MARKERS = "*dph8H|"  # no group has one of these: effects differ without colours, too
Looks = dict[str, tuple[str, str]]


@figure(
    title="What each effect contributes",
    caption=(
        "Left: norm of the force of each effect on the free vertices over the frames of a scene "
        "(of a hold: on the vertices that it holds). Right: how far the run moves "
        "when an effect is left out, before the horizon; the grey bar ends at the "
        "sensitivity floor, below which nothing can be told from round-off. Open markers "
        "lie below the floor, at the left edge where nothing changes at all. The only group of a "
        "scene cannot be left out."
    ),
    reads={
        "drawn": Settings(Drawn),
        "table": TableOf("effects_cost"),
        "contributions": EachOf(CONTRIBUTIONS, "experiments"),
    },
    options=Scenes,
)
def effects_contribution(
    options: Scenes, drawn: Drawn, table: pd.DataFrame, contributions: list[File]
) -> Figure:
    """Draw the forces of the first scenes over time, and beside them every scene and effect."""
    table = table.dropna(subset=["force"])
    scenes = drawn.scenes_of(table, "no contributions of effects")
    rows = table[table.scene.isin(scenes)]
    forces = {file["scene"]: read_table(file.path, FRAMES) for file in contributions}
    shown = sorted(scenes, key=lambda scene: -len(drawn.of(scene)))[:SHOWN]
    looks = _looks(drawn, rows[rows.moved.notna() | rows.scene.isin(shown)])
    figure = style.new_figure(0.24 * len(scenes) + 2.0)
    left, right = figure.subfigures(1, 2, width_ratios=(1.0, 1.15))
    axes = left.subplots(len(shown), 1, squeeze=False)[:, 0]
    for ax, scene in zip(axes, shown, strict=True):
        _draw_forces(ax, forces[scene], looks)
        ax.set_title(style.words(scene))
    axes[-1].set_xlabel("frame")
    axes[len(axes) // 2].set_ylabel("norm of the force (N)")
    _draw_moved(right.subplots(), rows, scenes, looks)
    named = {style.words(effect): look for effect, look in looks.items()}
    style.legend(figure, style.handles(named, markersize=4.5), 6)
    return figure


def _looks(drawn: Drawn, rows: pd.DataFrame) -> Looks:
    """Colours and markers: those of a group as everywhere else, of other effects in their order."""
    known = drawn.looks
    others = [effect for effect in dict.fromkeys(rows.effect) if effect not in known]
    groups = {effect: known[effect] for effect in dict.fromkeys(rows.effect) if effect in known}
    return groups | {
        effect: (OTHERS[i % len(OTHERS)], MARKERS[i % len(MARKERS)])
        for i, effect in enumerate(others)
    }


def _draw_forces(ax: Axes, frames: pd.DataFrame, looks: Looks) -> None:
    least = ROUNDOFF * frames.force.max()
    for effect, rows in frames.groupby("effect", sort=False):
        force = rows.force.where(rows.force > least)
        colour, marker = looks[str(effect)]
        if len(rows) > 1:
            ax.plot(rows.frame, force, color=colour, linewidth=1.1)
        else:
            ax.plot(rows.frame, force, color=colour, marker=marker, markersize=3.5)
    ax.set_yscale("log")
    style.grid(ax)


def _draw_moved(ax: Axes, rows: pd.DataFrame, scenes: list[str], looks: Looks) -> None:
    for y, scene in enumerate(scenes):
        own = rows[rows.scene == scene]
        floor = float(own.sensitivity_floor.iloc[0])
        ax.barh(y, floor - LOW, left=LOW, color="#DCD8D0", height=0.8, zorder=1)
        for row in own[own.moved.notna()].itertuples():
            colour, marker = looks[row.effect]
            ax.plot(
                [np.clip(row.moved, LOW, HIGH)], [y], marker=marker, markersize=4.5, zorder=3,
                color=colour, markerfacecolor=colour if row.above_floor else "white",
                clip_on=False,
            )  # fmt: skip
    style.label_rows(ax, [style.words(scene) for scene in scenes])
    ax.set_xscale("log")
    ax.set_xlim(LOW, HIGH)
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel("drift of the run without the effect")
    style.grid(ax)


UNLISTED = "forces, holds, contacts"
COLOURS = {UNLISTED: style.VERMILLION, RIGHT: style.SKY, GLOBAL: "#3A5A78", REST: "#C9C4BA"}


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
    costs = costs.assign(part=costs.effect.where(costs.effect.isin(list(colours)), UNLISTED))
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
