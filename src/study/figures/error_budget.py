"""Figure of the error budget: what keeps reduced models from following test trajectories."""

import numpy as np
import pandas as pd

from pdrom.model.held_out import MOTIONS
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact.reads import TableOf
from study.figures.kit.declaration import Drawn, figure
from study.figures.kit.multiples import label_rows

LOW, HIGH = 1e-4, 10.0  # limits of the error axes; errors outside are drawn on the limits
# Part -> (label, colour, marker).
PARTS = {
    "span": ("best approximation in the subspace", style.BLACK, "|"),
    "closure": ("converged reduced step, all elements", style.BLUE, "o"),
    "sampling": ("the same, sampled elements", style.GREEN, "s"),
    "run": ("the same, five local/global iterations", style.VERMILLION, "^"),
    "full_order": ("full order, the scene's iterations", style.ORANGE, "x"),
}
ERRORS = {"error": "position error", "deformation_error": "deformation error"}
APART = 0.27  # distance of two trajectories of a scene; scenes are 1 apart


@figure(title="Error budget of reduced models", reads={"table": TableOf("error_budget")})
def error_budget(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Errors of 40 POD modes on the three test trajectories of each scene, from top to bottom:
    slower and displaced, kicked, softer. Both errors are against the converged run and before the
    horizon. From mark to mark one simplification is added: the subspace itself, the equations
    restricted to it, sampled elements, five iterations. The cross is the full-order model with the
    scene's ten iterations. A run that blew up has no mark. Errors outside the axes are drawn on
    their limits.
    """
    table = table[table.skinning == 0]
    scenes = drawn.scenes_of(table)
    figure = style.new_figure(0.18 * len(scenes) + 1.1)
    axes = figure.subplots(1, len(ERRORS), sharey=True, squeeze=False)[0]
    for ax, (column, label) in zip(axes, ERRORS.items(), strict=True):
        ax.set_xscale("log")
        for y, scene in enumerate(scenes):
            for i, motion in enumerate(MOTIONS):
                rows = table[(table.scene == scene) & (table.motion == motion)]
                _draw(ax, rows.set_index("part")[column], y + APART * (i - 1))
        ax.axvline(0.1, color=style.GREY, linewidth=0.8, linestyle="--", zorder=0)
        ax.set(xlabel=label, xlim=(0.8 * LOW, 1.25 * HIGH))
    label_rows(axes[0], scenes)
    looks = {name: (colour, marker) for name, colour, marker in PARTS.values()}
    style.legend(figure, style.handles(looks, linestyle="none"), 2)
    return figure


def _draw(ax: Axes, errors: pd.Series, y: float) -> None:
    """Draw the errors of one trajectory, by part, in a row at height ``y``."""
    values = errors.dropna().clip(LOW, HIGH)
    own = values.drop("full_order", errors="ignore")
    ax.plot(own, np.full(len(own), y), color=style.GREY, linewidth=0.6, zorder=1)
    for part, (_, colour, marker) in PARTS.items():
        if part in values:
            ax.plot(values[part], y, marker, color=colour, markersize=3.0, markeredgewidth=0.9)
