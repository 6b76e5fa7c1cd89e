"""Time of an iteration against the number of vertices."""

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.multiples import plain_ticks
from study.artifact.reads import Settings, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, NothingToDraw, Scenes

PHASES = {
    "ms_per_iteration": ("whole iteration", "-"),
    "local_ms": ("local step", "--"),
    "global_ms": ("global solve", ":"),
}
NAMES = {"fom": "full order", "ecsw": "POD subspace, ecsw"}
COLOURS = {"fom": style.BLACK, "ecsw": "#1B6E6E"}
FITTED = ("fom", "ecsw")  # whose exponent is printed
ROOM = 2.6  # factor by which the axis goes on beyond the last mesh, for the exponents
MARKERS = {"fom": "o", "ecsw": ">"}


@figure(
    title="Cost against mesh size",
    caption=(
        "Time of one local/global iteration against the number of vertices: the full-order "
        "run, the same with only the local step reduced, and the hyper-reduced run in a position "
        "subspace, whose cost hardly depends on the mesh. Beside "
        "the ends of curves stands the exponent of a fitted power law, where there are three sizes "
        "of the mesh or more. Assembly and "
        "factorisation before the first frame are in the table `scaling`."
    ),
    reads={"drawn": Settings(Drawn), "table": TableOf("scaling")},
    options=Scenes,
)
def scaling(options: Scenes, drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Draw a panel per scene: the time of an iteration, by phase."""
    asked = options.scenes or tuple(dict.fromkeys(table.scene))
    scenes = [scene for scene in asked if (table.scene == scene).any()]
    if not scenes:
        raise NothingToDraw("no mesh sizes")
    figure = style.new_figure(2.9)
    times = figure.subplots(1, len(scenes), sharex=True, sharey=True, squeeze=False)[0]
    for ax, scene in zip(times, scenes, strict=True):
        rows = table[table.scene == scene].sort_values("vertices")
        _draw_times(ax, rows)
        ax.set_title(style.words(scene))
        ax.set_xlabel("vertices")
    sizes = table[table.scene.isin(scenes)].vertices
    times[0].set_xlim(0.75 * sizes.min(), ROOM * sizes.max())
    for axis in (times[0].xaxis, times[0].yaxis):  # shared by all panels
        low, high = np.log10(axis.get_view_interval())
        plain_ticks(axis, high - low)
    times[0].set_ylabel("time of an iteration (ms)")
    _legend(figure, drawn, list(dict.fromkeys(table.method)))
    return figure


def _draw_times(ax: Axes, rows: pd.DataFrame) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    style.grid(ax)
    for method, part in rows.groupby("method", sort=False):
        colour, marker = _style(str(method))
        for quantity, (_, line) in PHASES.items():
            ax.plot(
                part.vertices, part[quantity], line, color=colour,
                marker=marker if line == "-" else None, linewidth=1.3 if line == "-" else 0.9,
            )  # fmt: skip
        end = part.iloc[-1]
        if method in FITTED and end.exponent == end.exponent:
            ax.annotate(
                rf"$N^{{{end.exponent:.2f}}}$",
                (end.vertices, end.ms_per_iteration), xytext=(5, 0),
                textcoords="offset points", va="center", color=colour, fontsize=7.5,
            )  # fmt: skip


def _style(method: str) -> tuple[str, str]:
    colour, marker = style.method_styles([method])[method]
    return COLOURS.get(method, colour), MARKERS.get(method, marker)


def _legend(figure: Figure, drawn: Drawn, methods: list[str]) -> None:
    named = {NAMES.get(m) or drawn.title(m): _style(m) for m in methods}
    lines = [style.handle(label, color="#555555", linestyle=s) for label, s in PHASES.values()]
    style.legend(figure, [*style.handles(named), *lines], 4)
