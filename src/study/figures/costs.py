"""Figures of the cost of a run: by phase, effect and mesh size, and of reduced local steps."""

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Artist, Axes, Figure
from study.artifact.reads import TableOf
from study.experiments.kit.base import GLOBAL, REST, RIGHT
from study.figures.kit.declaration import MESHES, Drawn, NothingToDraw, figure, method_styles
from study.figures.kit.multiples import label_outer, label_rows, plain_ticks, small_multiples
from study.tables.effects_cost import NOTHING

# Phases of a frame: (label, colour). The first two form the local step, whose share is printed.
PHASES = {
    "local_ms": ("local step: projections", style.ORANGE),
    "assembly_ms": ("local step: right-hand side", "#F7D08A"),
    "global_ms": ("global solve", style.BLUE),
    REST: (REST, "#C9C4BA"),
}
TITLES = {"interpreted": "interpreted loop", "numpy": "vectorised NumPy", "compiled": "compiled"}
CLAIM = 70.0  # per cent of the time of a frame in the local step, by claim C1 of the preprint
CURVES = {
    "ms_per_iteration": ("whole iteration", "-"),
    "local_ms": ("local step", "--"),
    "global_ms": ("global solve", ":"),
    "vertices_ms": ("positions of all vertices", "-."),
}
# Method -> legend entry; beside its curve stands p of the fit time ~ (number of vertices)^p.
NAMES = {"fom": "full order", "ecsw": "POD subspace, ecsw"}
SCALED = {"fom": (style.BLACK, "o"), "ecsw": ("#1B6E6E", ">")}
ROOM = 2.6  # the axis ends at this multiple of the largest mesh size, to leave space for text
COLUMNS = 3  # panels in a row of figure `break_even`
UNLISTED = "forces, holds, contacts"
COLOURS = {UNLISTED: style.VERMILLION, RIGHT: style.SKY, GLOBAL: "#3A5A78", REST: "#C9C4BA"}
TICK = {"linestyle": "none", "marker": "|", "markersize": 9, "markeredgewidth": 1.4}
ACTING = (
    "cloth_all_oop spring_oop bend_curved strain_oop strain_poke_twin spring_twist_twin "
    f"strain_twist_twin cloth_all cloth_all_twin bar_release bar_twist {MESHES}"
)


@figure(
    title="Where the time of a frame goes", reads={"table": TableOf("local_share")},
    scenes=f"cloth_all spring_oop strain_oop bar_release {MESHES}", timed=True,
)  # fmt: skip
def local_share(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Share of the local step and of the global solve in the time of a full-order frame, for three
    implementations of the same local step; grey is the rest of the frame, such as prediction and
    contacts. The printed number is the share of the local step, that is of both shades of orange:
    the projections and the right-hand side that is assembled from them, in one pass where they are
    compiled. The dashed line is the 70 % of claim C1; beside the
    bar stands the time per frame. An interpreted loop confirms the claim everywhere, compiled code
    only where projections are expensive.
    """
    scenes = drawn.scenes_of(table, "no timings")
    present = set(table[table.scene.isin(scenes)].implementation)
    implementations = [i for i in TITLES if i in present]
    figure = style.new_figure(0.27 * len(scenes) + 1.35)
    axes = figure.subplots(1, len(implementations), sharey=True, squeeze=False)[0]
    for ax, implementation in zip(axes, implementations, strict=True):
        rows = table[table.implementation == implementation].drop_duplicates("scene")
        _draw_bars(ax, rows.set_index("scene"), scenes)
        ax.set(title=TITLES[implementation], xlabel="share of a frame (%)")
    label_rows(axes[0], scenes)
    handles: list[Artist] = [style.patch(label, color=c) for label, c in PHASES.values()]
    line = {"color": style.BLACK, "linestyle": "--"}
    handles.append(style.handle(f"{CLAIM:.0f} % (claim C1)", **line))
    style.legend(figure, handles, 3)
    return figure


def _draw_bars(ax: Axes, rows: pd.DataFrame, scenes: list[str]) -> None:
    for y, scene in enumerate(scenes):
        if scene not in rows.index:
            continue
        times = np.nan_to_num(rows.loc[scene, [*PHASES][:-1]].to_numpy(float))
        total = float(rows.ms_per_frame[scene])
        shares = 100.0 * np.array([*times, total - times.sum()]) / total
        _draw_bar(ax, y, shares, [colour for _, colour in PHASES.values()])
        printed = f"{100.0 * rows.local_share[scene]:.0f} %"
        ax.text(2.0, y, printed, va="center", ha="left", fontsize=7.5, fontweight="bold")
        words = f"{total:.2g} ms" if total < 99.5 else f"{total:.0f} ms"
        ax.text(102.0, y, words, va="center", ha="left", fontsize=7)
    ax.axvline(CLAIM, color=style.BLACK, linewidth=1.0, linestyle="--")
    ax.set(xlim=(0, 100), xticks=[0, 25, 50, 75, 100])
    ax.tick_params(axis="y", length=0)


def _draw_bar(ax: Axes, y: float, parts: np.ndarray, colours: list[str]) -> None:
    ends = np.cumsum(parts)
    ax.barh(np.full(len(parts), y), parts, left=ends - parts, color=colours, height=0.72)


@figure(
    title="Cost against mesh size", reads={"table": TableOf("scaling")},
    scenes=f"strain_oop spring_oop bar_release {MESHES}", timed=True,
)  # fmt: skip
def scaling(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Time of one local/global iteration against the number of vertices: the full-order run, the
    same with only the local step reduced, and the hyper-reduced run in a position subspace, with
    the positions of all vertices as a line of its own. Beside the ends of curves stands the
    exponent of a fitted power law, where there are three sizes of the mesh or more.
    """
    scenes = drawn.scenes_of(table, "no mesh sizes")
    figure, looks = style.new_figure(2.9), method_styles({*table.method}) | SCALED
    times = figure.subplots(1, len(scenes), sharex=True, sharey=True, squeeze=False)[0]
    for ax, scene in zip(times, scenes, strict=True):
        rows = table[table.scene == scene].sort_values("vertices")
        _draw_times(ax, rows, looks)
        ax.set(title=style.words(scene), xlabel="vertices")
    sizes = table[table.scene.isin(scenes)].vertices
    times[0].set_xlim(0.75 * sizes.min(), ROOM * sizes.max())
    for axis in (times[0].xaxis, times[0].yaxis):  # all panels share the axes of the first panel
        low, high = np.log10(axis.get_view_interval())
        plain_ticks(axis, high - low)
    times[0].set_ylabel("time of an iteration (ms)")
    named = {NAMES.get(m) or drawn.title(m): looks[m] for m in dict.fromkeys(table.method)}
    lines = [style.handle(label, color="#555555", linestyle=s) for label, s in CURVES.values()]
    style.legend(figure, [*style.handles(named), *lines], 4)
    return figure


def _draw_times(ax: Axes, rows: pd.DataFrame, looks: dict[str, tuple[str, str]]) -> None:
    ax.set(xscale="log", yscale="log")
    ax.grid(True)
    for method, part in rows.groupby("method", sort=False):
        colour, marker = looks[str(method)]
        for quantity, (_, line) in CURVES.items():
            look = {"marker": marker, "linewidth": 1.3} if line == "-" else {"linewidth": 0.9}
            time = part[quantity].where(part[quantity] > 0.0)
            ax.plot(part.vertices, time, line, color=colour, **look)
        end = part.iloc[-1]
        if method in NAMES and end.exponent == end.exponent:
            at, look = (end.vertices, end.ms_per_iteration), {"va": "center", "fontsize": 7.5}
            words = rf"$N^{{{end.exponent:.2f}}}$"
            ax.annotate(words, at, (5, 0), textcoords="offset points", color=colour, **look)


@figure(
    title="When a reduced local step stops paying", reads={"table": TableOf("breakeven")},
    methods="deim deim-joint block-deim gappy", timed=True,
)  # fmt: skip
def break_even(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Time of the reduced local step over that of the full one, both compiled and on one thread,
    against the number $r$ of basis vectors; one line per scene and method, timed alone on states of
    the full-order run. Above the dashed line the reduction costs more than all projections. Lines
    end at the numerical rank.
    """
    table = drawn.rows(table)
    table = table[table.factor == 1.0]
    if table.empty:
        raise NothingToDraw("no reduced local step was timed")
    groups = [g for g in drawn.looks if (table.group == g).any()]
    figure, axes = small_multiples(len(groups), COLUMNS, legend_rows=2, height=1.8)
    styles = method_styles([m for m in drawn.methods if (table.method == m).any()])
    for ax, group in zip(axes, groups, strict=True):
        ax.set(title=style.words(group), yscale="log")
        ax.grid(True)
        ax.axhline(1.0, color=style.BLACK, linestyle="--", linewidth=1.0, zorder=1)
        own = table[table.group == group]
        for (_, method), curve in own.groupby(["scene", "method"], sort=False):
            colour, marker = styles[str(method)]
            curve = curve.sort_values("r")
            look = {"marker": marker, "markersize": 2.6, "linewidth": 0.8, "alpha": 0.75}
            ax.plot(curve.r, curve.ratio, color=colour, **look)
        ax.set_xlim(left=0.0)
    label_outer(axes, COLUMNS, "basis vectors r", "reduced over full local step")
    one = style.handle("break-even", color=style.BLACK, linestyle="--")
    style.legend(figure, [*drawn.handles(styles), one], 3)
    return figure


@figure(
    title="What each effect costs", reads={"table": TableOf("effects_cost")}, scenes=ACTING,
    timed=True,
)  # fmt: skip
def effects_cost(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Left: share of each effect in the time of a full-order frame, which is printed beside the
    bar. Right: the frame of one scene built without some of its effects; the tick is the whole less
    what these effects cost in it. A bar that ends at the tick pays nothing for what the scene does
    not list.
    """
    costs, removed = table.dropna(subset=["share"]), table.dropna(subset=["without_ms"])
    removed = removed.sort_values("effect", key=lambda name: name != NOTHING, kind="stable")
    scenes = drawn.scenes_of(costs, "no timings of effects")
    several = [scene for scene in scenes if (removed.scene == scene).any()]
    rows = removed[removed.scene == several[0]] if several else removed[:0]
    figure = style.new_figure(0.27 * max(len(scenes), len(rows)) + 1.3)
    axes = figure.subplots(1, 2 if several else 1, squeeze=False)[0]
    colours = {group: colour for group, (colour, _) in drawn.looks.items()} | COLOURS
    parts = _draw_scenes(axes[0], costs, scenes, colours)
    handles: list = [style.patch(style.words(part), color=colours[part]) for part in parts]
    if several:
        _draw_left_out(axes[1], rows, several[0])
        handles.append(style.handle("whole less its own cost", color=style.BLACK, **TICK))
    style.legend(figure, handles, 4)
    return figure


def _draw_scenes(
    ax: Axes, costs: pd.DataFrame, scenes: list[str], colours: dict[str, str]
) -> list[str]:
    """Draw a frame's time per scene as a bar of parts (effects, phases); return names of parts."""
    costs = costs.assign(part=costs.effect.where(costs.effect.isin(list(colours)), UNLISTED))
    parts = [part for part in colours if (costs.part == part).any()]
    for y, scene in enumerate(scenes):
        rows = costs[costs.scene == scene]
        shares = 100.0 * rows.groupby("part").share.sum().reindex(parts, fill_value=0.0)
        _draw_bar(ax, y, shares.clip(lower=0.0).to_numpy(), [colours[part] for part in parts])
        total = rows.ms_per_frame.sum()
        ax.text(101.0, y, f"{total:.2g} ms", va="center", ha="left", fontsize=7)
    label_rows(ax, scenes)
    ax.set(xlim=(0, 100), xlabel="share of a full-order frame (%)", ylabel="scene")
    return parts


def _draw_left_out(ax: Axes, rows: pd.DataFrame, scene: str) -> None:
    whole = float(rows.without_ms.iloc[0])
    shades = {1: "#BFD3E0", 2: "#8FB2C9", 3: "#5F90B2"}
    for y, row in enumerate(rows.itertuples()):
        ax.barh(y, row.without_ms, color=shades.get(row.groups, "#5F90B2"), height=0.72)
        if row.ms_per_frame > 0.0:
            ax.plot([whole - row.ms_per_frame], [y], color=style.BLACK, **TICK)
    label_rows(ax, [f"without {e}" if e != NOTHING else "whole" for e in rows.effect])
    ax.set(xlim=(0.0, 1.15 * float(rows.without_ms.max())), xlabel="time per frame (ms)")
    ax.set_title(style.words(scene))
