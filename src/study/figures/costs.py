"""Figures of computing time: by phase of a frame, by mesh size, and of reduced local steps."""

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Artist, Axes, Figure
from study.artifact import words
from study.artifact.reads import TableOf
from study.experiments.kit.base import REST
from study.figures.kit.declaration import GROUPS, MESHES, Drawn, figure, held, method_styles
from study.figures.kit.multiples import label_outer, label_rows, plain_ticks, small_multiples

# Phase of a frame -> label, colour. The first two phases are the local step.
PHASES = {
    "local_ms": ("local step: projections", style.ORANGE),
    "assembly_ms": ("local step: right-hand side", "#F7D08A"),
    "global_ms": ("global solve", style.BLUE),
    REST: (REST, "#C9C4BA"),
}
TITLES = {"interpreted": "interpreted loop", "numpy": "vectorised NumPy", "compiled": "compiled"}
CLAIM = 70.0  # per cent of a frame that the local step takes, by claim C1 of the preprint
CURVES = {
    "ms_per_iteration": ("complete iteration", "-"),
    "local_ms": ("local step", "--"),
    "global_ms": ("global solve", ":"),
    "vertices_ms": ("positions of all vertices", "-."),
}
# Methods whose curves are labelled with the exponent p of the fit time ~ (number of vertices)^p.
FITTED = ("fom", "ecsw")
ROOM = 2.6  # the axis ends at this multiple of the largest mesh size, to leave space for labels
COLUMNS = 3  # panels in a row of figure `break_even`


@figure(
    title="Shares of the time of a frame", reads={"table": TableOf("local_share")},
    scenes=f"cloth_all spring_oop strain_oop bar_release {MESHES}", timed=True,
)  # fmt: skip
def local_share(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """In interpreted code the local step takes nearly all the time of a frame. In compiled code its
    share exceeds the 70 % of the preprint's claim C1 (dashed line) only if projections are
    expensive. Each bar is one scene and one of three implementations of the same local step. The
    printed percentage is the share of the whole local step: projections (orange) plus assembly of
    the right-hand side (light orange). Compiled code does both in one pass, drawn in orange. Grey
    is the remaining time, for example for contacts. To the right of each bar: time per frame.
    """
    scenes = drawn.scenes_of(table)
    present = set(table[table.scene.isin(scenes)].implementation)
    implementations = [i for i in TITLES if i in present]
    figure = style.new_figure(0.22 * len(scenes) + 1.3)
    axes = figure.subplots(1, len(implementations), sharey=True, squeeze=False)[0]
    for ax, implementation in zip(axes, implementations, strict=True):
        rows = table[table.implementation == implementation].drop_duplicates("scene")
        _draw_bars(ax, rows.set_index("scene"), scenes)
        ax.set(title=TITLES[implementation], xlabel="share of a frame (%)")
    label_rows(axes[0], [words.scene(scene) for scene in scenes])
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
        colours = [colour for _, colour in PHASES.values()]
        ax.barh([y] * 4, shares, left=np.cumsum(shares) - shares, color=colours, height=0.72)
        printed = f"{100.0 * rows.local_share[scene]:.0f} %"
        ax.text(2.0, y, printed, va="center", ha="left", fontsize=7.5, fontweight="bold")
        time = f"{total:.2g} ms" if total < 99.5 else f"{total:.0f} ms"
        ax.text(102.0, y, time, va="center", ha="left", fontsize=7.5)
    ax.axvline(CLAIM, color=style.BLACK, linewidth=1.0, linestyle="--")
    ax.set(xlim=(0, 100), xticks=[0, 25, 50, 75, 100])
    ax.tick_params(axis="y", length=0)


@figure(
    title="Time of an iteration against mesh size", reads={"table": TableOf("scaling")},
    scenes=f"strain_oop spring_oop bar_release {MESHES}", timed=True,
)  # fmt: skip
def scaling(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """The time of a full-order iteration grows with the mesh much faster than the time of an
    iteration with reduced positions. Solid: time of a complete local/global iteration for $N$
    vertices. Other lines: its parts. All vertex positions are computed once per frame; this time is
    divided by the number of iterations. Labels: fitted powers of $N$ (at least three mesh sizes).
    """
    scenes = drawn.scenes_of(table)
    figure, looks = style.new_figure(2.9), method_styles({*table.method})
    times = figure.subplots(1, len(scenes), sharex=True, sharey=True, squeeze=False)[0]
    for ax, scene in zip(times, scenes, strict=True):
        rows = table[table.scene == scene].sort_values("vertices")
        _draw_times(ax, rows, looks)
        ax.set(title=words.scene(scene), xlabel="vertices")
    sizes = table[table.scene.isin(scenes)].vertices
    times[0].set_xlim(0.75 * sizes.min(), ROOM * sizes.max())
    for axis in (times[0].xaxis, times[0].yaxis):  # all panels share the axes of the first panel
        low, high = np.log10(axis.get_view_interval())
        plain_ticks(axis, high - low)
    times[0].set_ylabel("time of an iteration (ms)")
    named = {drawn.title(m): looks[m] for m in dict.fromkeys(table.method)}
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
        if method in FITTED and end.exponent == end.exponent:
            at, look = (end.vertices, end.ms_per_iteration), {"va": "center", "fontsize": 7.5}
            power = rf"$N^{{{end.exponent:.2f}}}$"
            ax.annotate(power, at, (5, 0), textcoords="offset points", color=colour, **look)


@figure(
    title="Cost of the reduced local step", reads={"table": TableOf("breakeven")},
    methods="deim deim-joint block-deim gappy", timed=True,
)  # fmt: skip
def break_even(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Up to a basis size that depends on the cost of a projection, a reduced local step is faster
    than the full local step. The ratio of the times (compiled, on one thread) is drawn against the
    number $r$ of basis vectors. Above the dashed line the reduced step is slower. Each panel has
    one kind of constraint, each line one scene and method. Local steps are timed outside of
    simulations, at full-order positions. Lines end at the largest basis size (numerical rank).
    """
    table = held(drawn.rows(table).query("factor == 1.0"))
    groups = [group for group in GROUPS if (table.group == group).any()]
    figure, axes = small_multiples(len(groups), COLUMNS, legend_rows=2, height=1.5)
    styles = drawn.styles(table)
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
    label_outer(axes, COLUMNS, "basis vectors r", "reduced / full local step")
    one = style.handle("break-even", color=style.BLACK, linestyle="--")
    style.legend(figure, [*drawn.handles(styles), one], 3)
    return figure
