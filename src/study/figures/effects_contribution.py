"""Contribution of each effect of a scene to its run."""

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact.paths import CONTRIBUTIONS, File
from study.artifact.reads import EachOf, Settings, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, Scenes

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
