"""Variants of block DEIM in a position subspace: what mends it, and by how much."""

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.multiples import clipped
from pdrom.view.text import plain_words
from study.artifact.reads import TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Scenes
from study.figures.kit.results import NothingToDraw, Results

RATIOS = (0.5, 300.0)  # of errors; outside, and where a run blew up, points lie on the rim
GAINS = (1.0, 40.0)


@figure(
    title="What mends block DEIM in a position subspace",
    caption=(
        "Runs with positions and projections reduced, divided by the error of the full "
        "projections in the same snapshot subspace (dashed: no worse). Above the line one change "
        "at a time, below it combinations. Points on the right rim blew up or are worse still; "
        "crosses mark bases that the gain check refused. Right, the gain."
    ),
    reads=(TableOf("subspace_ablation"),),
    options=Scenes,
)
def subspace_ablation(results: Results, options: Scenes) -> Figure:
    """Draw a row per variant, a marker per scene, a panel per number of modes, and the gain.

    The error is divided by that of the full projections in the same subspace. Rows with a plus in
    their name combine several changes and stand below the line.
    """
    table = results.asked_rows("subspace_ablation", options)
    if table.empty:
        raise NothingToDraw("no scene of the ablation")
    # one size of the position basis is one picture
    table = table[table.k == table.k.max()]
    variants, scenes = (list(dict.fromkeys(table[name])) for name in ("variant", "scene"))
    ranks = sorted(table.r.unique())
    figure = style.new_figure(0.21 * len(variants) + 1.2)
    panels = figure.subplots(1, len(ranks) + 1, sharey=True)
    for ax, r in zip(panels, ranks, strict=False):
        rows = table[table.r == r]
        ratio = rows.relative_error_within_horizon / rows.relative_error_full_projections
        _draw_points(ax, rows.assign(value=ratio), variants, scenes, RATIOS)
        ax.axvline(1.0, color=style.BLACK, linewidth=0.8, linestyle="--", zorder=0)
        ax.set_xlabel("error / error of\nfull projections")
        ax.set_title(f"r = {r}")
    rows = table[(table.r == ranks[-1]) & table.gain.notna()]
    _draw_points(panels[-1], rows.assign(value=rows.gain), variants, scenes, GAINS)
    panels[-1].set_xlabel("gain of the\ninterpolation")
    panels[-1].set_title(f"r = {ranks[-1]}")
    style.label_rows(panels[0], [plain_words(variant) for variant in variants])
    refused = {"linestyle": "none", "marker": "x", "color": style.GREY}
    handles = [*style.scene_handles(scenes), style.handle("refused (not run)", **refused)]
    style.legend(figure, handles, 5)
    return figure


def _draw_points(
    ax: Axes,
    table: pd.DataFrame,
    variants: list[str],
    scenes: list[str],
    limits: tuple[float, float],
) -> None:
    ax.set_xscale("log")
    ax.set_xlim(limits[0], limits[1] * 1.4)
    style.grid(ax)
    for i, scene in enumerate(scenes):
        rows = table[table.scene == scene]
        heights = rows.variant.map(variants.index) + 0.13 * (i - 0.5 * (len(scenes) - 1))
        # a refused basis has no gain; with a gain and no error the run blew up
        refused = rows.gain.isna().to_numpy()
        values = np.nan_to_num(rows.value.to_numpy(float), nan=np.inf)
        values = clipped(values, *limits)
        colour, marker = style.scene_style(i)
        for chosen, shape in ((~refused, marker), (refused, "x")):
            ax.plot(
                values[chosen], heights[chosen], linestyle="none", color=colour, marker=shape,
                markersize=3.2,
            )  # fmt: skip
    combined = [i for i, variant in enumerate(variants) if "+" in variant]
    if combined:
        ax.axhline(combined[0] - 0.5, color="#333333", linewidth=0.8)
