"""Errors of runs against their estimates, which need no full order."""

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.multiples import clipped, log_axes
from study.artifact.reads import Setting, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Scenes
from study.figures.kit.results import NothingToDraw, Results
from study.tables.estimates import BAND

LIMITS = (1e-4, 1e1)
FAMILIES = {
    "projections alone": ("full", style.BLUE),
    "snapshot subspace": ("pod", style.VERMILLION),
    "skinning subspace": ("skinning", style.GREEN),
}
SPLITS = {"train": "training motions", "heldout": "held-out motions"}


@figure(
    title="Estimated errors",
    caption=(
        "A dot for every run: its error within the horizon against the estimate, its distance to "
        "the auxiliary model. Left are the training motions, right the held-out ones, of which "
        "only the auxiliary model's run is used. Between the dashed lines the estimate is within a "
        "factor of three. Open dots are not resolved: the estimate is at most one and a half times "
        "the auxiliary model's own error on the training motion, so that the error is only known "
        "to be small. Dotted: {guard.threshold}, above which a guard takes it as an alarm. What "
        "lies outside is drawn on the rim."
    ),
    reads=(TableOf("estimates"), Setting("guard.threshold")),
    options=Scenes,
)
def estimates(results: Results, options: Scenes) -> Figure:
    """Draw a panel for each motion."""
    table = results.table("estimates")
    table = table[table.scene.isin(results.scenes(options))]
    table = table[table.ratio.notna()]
    if table.empty:
        raise NothingToDraw("no run with an estimate and an error")
    alarm = float(results.settings["guard.threshold"])
    figure = style.new_figure(3.6)
    axes = figure.subplots(1, 2, sharey=True)
    for ax, (split, title) in zip(axes, SPLITS.items(), strict=True):
        _draw(ax, table[table.split == split], title, alarm)
    axes[0].set_ylabel("estimate")
    looks = {name: (colour, "o") for name, (_, colour) in FAMILIES.items()}
    style.legend(figure, style.handles(looks, linestyle="none", markersize=4), 3)
    return figure


def _draw(ax: Axes, runs: pd.DataFrame, title: str, alarm: float) -> None:
    log_axes(ax, LIMITS, LIMITS)
    ends = np.array(LIMITS)
    ax.plot(ends, ends, color="#333333", linewidth=0.8, zorder=0)
    for factor in BAND:
        ax.plot(ends, factor * ends, color="#333333", linewidth=0.7, linestyle="--", zorder=0)
    ax.axhline(alarm, color="#333333", linewidth=0.7, linestyle=":", zorder=0)
    resolved = runs.resolved.astype(bool)
    for basis, colour in FAMILIES.values():
        for kept, face in ((resolved, colour), (~resolved, "none")):
            part = runs[(runs.position_basis == basis) & kept]
            if part.empty:
                continue
            ax.plot(
                clipped(part.relative_error_within_horizon.to_numpy(float), *LIMITS),
                clipped(part.estimate.to_numpy(float), *LIMITS),
                "o", markersize=3.0, color=colour, markerfacecolor=face, markeredgewidth=0.5,
                alpha=0.7, clip_on=False,
            )  # fmt: skip
    share = runs.within.astype(bool).mean() if len(runs) else float("nan")
    ax.set_title(f"{title}: {100 * share:.0f} % of {len(runs)} within the band")
    ax.set_xlabel("error within the horizon (relative)")
