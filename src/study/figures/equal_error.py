"""Figure of speed-ups of reduced models over full-order settings that are as accurate."""

import numpy as np
import pandas as pd

from pdrom.model.held_out import MOTIONS
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact import words
from study.artifact.reads import TableOf
from study.figures.kit.declaration import figure, held
from study.figures.kit.labels import Curve, label_curves
from study.figures.kit.multiples import plain_ticks

MESH = ["vertices", "scene", "factor", "stiffness"]  # columns that identify a mesh, by its size
AGAINST = {"same": "full-order model on the same mesh", "coarser": "also on coarser meshes"}
LOOKS = {
    "springs": (style.VERMILLION, "^"), "triangles": (style.BLUE, "s"),
    "tetrahedra": (style.GREEN, "o"),
}  # fmt: skip
WRONG = 0.1  # marks of larger position errors are hollow
APART, BESIDE = 1.045, 1.17  # ratios of x between neighbouring marks of a mesh, and between meshes
LARGE = 0.5  # errors are printed for meshes with more than this share of the most vertices
HEIGHT = 2.6  # height of the figure, inches


@figure(
    title="Speed-up of reduced models at equal error", reads={"table": TableOf("equal_error")},
    timed=True,
)  # fmt: skip
def equal_error(table: pd.DataFrame) -> Figure:
    """On large meshes the reduced model is mostly faster than the full-order model on the same mesh
    (left). If coarser full-order meshes are also allowed (right), the long bar is the only example
    in which the reduced model is faster on all test trajectories. Speed-up: time of the fastest
    full-order setting whose position error is at most that of the reduced model, divided by the
    time of the reduced model without its training (POD subspace, ECSW, five iterations, two
    training trajectories). Each mesh has three marks, one for each test trajectory; on the left,
    labels give their errors on large meshes. Hollow marks: errors above 10 %. Vertical lines:
    bootstrap intervals over repeated runs. *: partly recorded earlier or on another machine.
    """
    table = table[table.iterations.notna() & (table.stiffness == 1.0)]
    table = held(table.dropna(subset=[f"{name}_speedup" for name in AGAINST]).sort_values(MESH))
    table = table[table.training_motions == table.training_motions.max()]
    ends = table[[f"{name}_speedup_{end}" for name in AGAINST for end in ("low", "high")]]
    low, high = min(1.0, ends.min(axis=None)) / 1.4, max(1.0, ends.max(axis=None)) * 1.6
    figure = style.new_figure(HEIGHT)
    axes = figure.subplots(1, len(AGAINST), sharex=True, sharey=True, squeeze=False)[0]
    sizes = table.vertices.min() / 1.7, table.vertices.max() * 1.7
    axes[0].set(xscale="log", yscale="log", xlim=sizes, ylim=(low, high))
    plain_ticks(axes[0].xaxis, np.log10(sizes[1] / sizes[0]))
    plain_ticks(axes[0].yaxis, np.log10(high / low))
    axes[0].set_ylabel("speed-up at equal position error")
    for ax, (name, title) in zip(axes, AGAINST.items(), strict=True):
        ax.grid(True)
        ax.axhline(1.0, color=style.BLACK, linewidth=1.0, zorder=0)
        ax.set(title=title, xlabel="vertices")
        equal = ("", "", np.array([[size, 1.0] for size in sizes]))
        label_curves(ax, [*_draw(ax, table, name), equal], (0.44 * style.WIDTH, HEIGHT - 0.85))
    style.legend(figure, style.handles(LOOKS, linestyle="none"), len(LOOKS))
    return figure


def _draw(ax: Axes, table: pd.DataFrame, against: str) -> list[Curve]:
    """Draw the speed-ups of all meshes over the settings ``against``; return their labels."""
    labelled = list[Curve]()
    for size, meshes in table.groupby("vertices"):
        for place, (_, rows) in enumerate(meshes.groupby(MESH)):
            middle = place - 0.5 * (meshes.groupby(MESH).ngroups - 1)
            at = [MOTIONS.index(motion) - 1.0 for motion in rows.motion]
            x = float(size) * BESIDE**middle * APART ** np.array(at)
            for mark, (_, row) in zip(x, rows.iterrows(), strict=True):
                _draw_mark(ax, mark, row, against)
                ends = row[f"{against}_speedup_low"], row[f"{against}_speedup_high"]
                labelled.append(("", "", np.array([[mark, end] for end in ends])))
            first, large = rows.iloc[0], size > LARGE * table.vertices.max()
            text = words.scene(str(first.scene)) + ("*" if rows.recorded.notna().any() else "")
            if large and against == "same":
                text += ": " + ", ".join(f"{100.0 * e:.2g}" for e in rows.position_error) + " %"
            elif first.elements != "tetrahedra" and not large:
                text = ""  # the colour identifies the small sheets
            points = np.stack([x, rows[f"{against}_speedup"]], axis=1)
            labelled.append((text, LOOKS[first.elements][0], points))
    return labelled[::-1]  # large meshes first


def _draw_mark(ax: Axes, x: float, row: pd.Series, against: str) -> None:
    """Draw the speed-up on one trajectory at ``x``: mark, interval, arrow if a lower bound."""
    speedup, low, high = (row[f"{against}_speedup{end}"] for end in ("", "_low", "_high"))
    if not row.known:
        ax.plot(x, speedup, "x", color=style.GREY, markersize=3.5)
        return
    colour, marker = LOOKS[row.elements]
    face = colour if row.position_error <= WRONG else "white"
    ax.plot([x, x], [low, high], color=colour, linewidth=0.9)
    ax.plot(x, speedup, marker, color=colour, markerfacecolor=face, markersize=4.0)
    if not row[f"{against}_reached"]:
        ax.plot(x, high * 1.1, marker=6, color=colour, markersize=5.0)  # an arrow upwards
