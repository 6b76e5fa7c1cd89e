"""Figure of the speed-ups of reduced models over full-order settings of equal error."""

import numpy as np
import pandas as pd

from pdrom.model.held_out import MOTIONS
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact.reads import TableOf
from study.figures.kit.declaration import figure, held
from study.figures.kit.multiples import plain_ticks

MESH = ["vertices", "scene", "factor", "stiffness"]  # columns that name a mesh, by its size
AGAINST = {"same": "against the same mesh", "coarser": "against the same and coarser meshes"}
COLOURS = {"springs": style.VERMILLION, "triangles": style.BLUE, "tetrahedra": style.GREEN}
WRONG = 0.1  # position error above which a mark is hollow
APART = 0.29  # distance of two trajectories of a mesh; meshes are 1 apart
ARROW = "\N{UPWARDS ARROW}"
HOLLOW = {"color": style.BLACK, "markerfacecolor": "white", "linestyle": "none"}
UNKNOWN = {"color": style.GREY, "marker": "x", "markersize": 2.5, "linestyle": "none"}


@figure(
    title="Speed-up of reduced models at equal error", reads={"table": TableOf("equal_error")},
    timed=True,
)  # fmt: skip
def equal_error(table: pd.DataFrame) -> Figure:
    r"""Speed-up of the reduced model (POD subspace, ecsw) over the fastest full-order setting whose
    position error is at most as large. Above the line at 1 the reduced model is faster. Left: the
    opponents simulate the same mesh; right: they may also simulate a coarser mesh, whose
    displacement is interpolated. Each row is a fixed setting of the reduced model. On each mesh,
    the marks from left to right are the test trajectories: slower and displaced, kicked, softer.
    Vertical lines are bootstrap intervals over processes. The number beside a mark is the position
    error in per cent, over all frames, against the converged step of that mesh (inf: blown up); the
    mark is hollow where it exceeds 10 %. A hollow mark with an arrow: no full-order setting is as
    accurate, so that the speed-up over the most accurate one is a lower bound. A grey cross: the
    converged step is not known to a third of the error, so that nothing is judged. Training times
    are not included. Models and opponents were named before these runs, with trials on the same
    scenes known; iterations beyond ten on coarser meshes were added after one, and Chebyshev's
    fixed rate was set on these scenes. $\times 100$: stiffer weights; *: with recorded rows.
    """
    table = held(table.dropna(subset=[f"{name}_speedup" for name in AGAINST]).sort_values(MESH))
    table = table.assign(place=table.groupby(MESH).ngroup())  # x of the mesh
    settings = list(table.groupby(["method", "training_motions"]))
    figure = style.new_figure(1.25 * len(settings) + 1.5)
    axes = figure.subplots(len(settings), len(AGAINST), sharex=True, sharey=True, squeeze=False)
    _set_axes(axes[0, 0], table)
    for row, ((_, trained), rows) in zip(axes, settings, strict=True):
        for ax, name in zip(row, AGAINST, strict=True):
            _draw_panel(ax, rows, name)
        count = rows.iterations.max()
        solved = "converged (Newton)" if np.isnan(count) else f"{count:.0f} iterations"
        row[0].set_ylabel(f"{solved},\ntraining trajectories: {trained:.0f}", fontsize=6.5)
    for column, title in zip(axes.T, AGAINST.values(), strict=True):
        column[0].set_title(title)
        column[-1].set_xlabel("scene and vertices")
    figure.supylabel("speed-up at equal position error", fontsize=8.0)
    texts = f"error above {100 * WRONG:g} %", f"{ARROW} no opponent is as accurate (lower bound)"
    entries = [style.handle(k, marker="o", color=c, linestyle="none") for k, c in COLOURS.items()]
    entries += [style.handle(text, marker="o", **HOLLOW) for text in texts]
    entries.append(style.handle("not judged", **UNKNOWN))
    style.legend(figure, entries, 3)
    return figure


def _set_axes(ax: Axes, table: pd.DataFrame) -> None:
    """Set the shared axes of all panels: one place for each mesh, and all intervals."""
    names = []
    for (vertices, scene, _, stiffness), rows in table.groupby(MESH):
        stiff = "" if stiffness == 1.0 else rf" $\times {stiffness:g}$"
        mark = "*" if rows.recorded.notna().any() else ""
        names.append(f"{style.words(scene)}{stiff}, {vertices:,.0f}{mark}")
    ends = table[[f"{name}_speedup_{end}" for name in AGAINST for end in ("low", "high")]]
    low, high = min(1.0, ends.min(axis=None)), max(1.0, ends.max(axis=None))
    ax.set(yscale="log", ylim=(low / 1.4, high * 1.4), xlim=(-0.6, len(names) - 0.4))
    plain_ticks(ax.yaxis, np.log10(high / low))
    ax.set_xticks(range(len(names)), names)


def _draw_panel(ax: Axes, rows: pd.DataFrame, against: str) -> None:
    """Draw the ``rows`` of one setting against one kind of opponents."""
    ax.grid(True, axis="y")
    ax.axhline(1.0, color=style.GREY, linewidth=1.0, zorder=0)
    ax.tick_params(axis="x", length=0, labelrotation=90, labelsize=6.5)
    for place in range(1, len(ax.get_xticks()), 2):
        ax.axvspan(place - 0.5, place + 0.5, color="#F3F1EC", linewidth=0, zorder=-1)
    for _, row in rows.iterrows():
        _draw_mark(ax, row.place + APART * (MOTIONS.index(row.motion) - 1), row, against)


def _draw_mark(ax: Axes, x: float, row: pd.Series, against: str) -> None:
    """Draw one trajectory at ``x``: speed-up, interval, error, an arrow if it is a lower bound."""
    speedup, low, high = (row[f"{against}_speedup{end}"] for end in ("", "_low", "_high"))
    if not row.known:
        ax.plot(x, speedup, **UNKNOWN)
        return
    colour, reached = COLOURS[row.elements], row[f"{against}_reached"]
    face = colour if reached and row.position_error <= WRONG else "white"
    ax.plot([x, x], [low, high], color=colour, linewidth=0.9)
    ax.plot(x, speedup, "o", color=colour, markerfacecolor=face, markersize=3.0)
    text = np.format_float_positional(100.0 * row.position_error, 2, fractional=False, trim="-")
    look = {"textcoords": "offset points", "ha": "center", "fontsize": 5.5}
    if not reached:
        ax.annotate(
            ARROW, (x, high), (0, 1), color=colour, va="bottom", **{**look, "fontsize": 7.5}
        )
    bottom, top = np.log(ax.get_ylim())
    if np.log(high) > 0.4 * bottom + 0.6 * top:  # more room below
        ax.annotate(text, (x, low), (0, -3), va="top", rotation=90, **look)
    else:
        ax.annotate(text, (x, high), (0, 3 if reached else 10), va="bottom", rotation=90, **look)
