"""Figure of the error budget: parts of the error of reduced models on test trajectories."""

import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Figure
from study.artifact import words
from study.artifact.reads import TableOf
from study.figures.kit.declaration import Drawn, figure
from study.figures.kit.multiples import label_rows

LOW, HIGH = 1e-3, 3.0  # limits of the error axis; errors outside are drawn on the limits
# Part -> (label, colour, marker).
PARTS = {
    "span": ("span: best approximation in the subspace", "#5A5A5A", "|"),
    "closure": ("closure: converged reduced step", style.PURPLE, "o"),
    "sampling": ("sampling: in addition, sampled elements", "#332288", "s"),
    "run": ("iterations: in addition, five iterations", style.GREEN, ">"),
    "full_order": ("full-order model with ten iterations", style.BLACK, "x"),
}
ROW = 0.14  # height of a row, inches
MARK = {"markersize": 4.2, "markeredgewidth": 1.2, "linestyle": "none"}
RING = {"markersize": 7.0, "markerfacecolor": "none"}  # the closure, around the sampling


@figure(title="Sources of the error of reduced models", reads={"table": TableOf("error_budget")})
def error_budget(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """In most scenes, the largest part of the error comes from restricting the equations to the
    subspace (Galerkin closure) or from stopping after five iterations. Sampling adds little. Marks:
    medians, over three test trajectories, of the deformation error of the reduced model (40 POD
    modes) up to the predictability horizon. The reference is the converged step of the full-order
    model. Each mark adds one simplification to the mark before it. Cross: full-order model. The
    dashed line is an error of 10 %; errors outside the axis are drawn on its limits.
    """
    table = table[table.skinning == 0]
    scenes = drawn.scenes_of(table)
    figure = style.new_figure(ROW * len(scenes) + 1.05)
    ax = figure.subplots()
    ax.set(xscale="log", xlim=(0.9 * LOW, 1.1 * HIGH), xlabel="deformation error")
    ax.axvline(0.1, color=style.GREY, linewidth=0.8, linestyle="--", zorder=0)
    medians = table.groupby(["scene", "part"]).deformation_error.median().clip(LOW, HIGH)
    for y, scene in enumerate(scenes):
        errors = medians[scene].dropna()
        reduced = errors.drop("full_order", errors="ignore")
        ax.plot([reduced.min(), reduced.max()], [y, y], color="#C0C0C0", linewidth=1.0, zorder=1)
        for part, (_, colour, marker) in PARTS.items():
            if part in errors:
                look = MARK | (RING if part == "closure" else {})
                ax.plot(errors[part], y, marker=marker, color=colour, **look)
    label_rows(ax, [words.scene(scene) for scene in scenes])
    looks = {name: (colour, marker) for name, colour, marker in PARTS.values()}
    handles = style.handles(looks, **MARK)
    handles[1].set(**RING)
    style.legend(figure, handles, 2)
    return figure
