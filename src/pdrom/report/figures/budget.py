"""Smallest error for a few budgets of time a frame."""

from typing import Any

import numpy as np
import pandas as pd

from pdrom.artifact.reads import TableOf
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Axes, Figure
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.multiples import clipped
from pdrom.report.figures.kit.options import Scenes
from pdrom.report.figures.kit.results import Results
from pdrom.tables.accuracy_cost import CONVERGED, FEWER, OWN

LOW, HIGH = 1e-5, 3.0  # errors outside are drawn on the limit
FULL = "full order fits"
_FOM = {"color": style.FAILED, "marker": "d", "markerfacecolor": "white", "linestyle": "none"}


@figure(
    title="What a frame's time buys",
    caption=(
        "The setting with the smallest error within the horizon that fits a time per frame. "
        "Filled markers: reduced models, or the full-order run stopped earlier, against the "
        "scene's own full-order run. Hollow markers: the full-order run with the best number $K$ "
        "of iterations that fits, against the converged run. The two errors have different "
        "references. A mark on the left rim stands for an error at it or below."
    ),
    reads=(TableOf("budget"),),
    options=Scenes,
)
def budget(results: Results, options: Scenes) -> Figure:
    """Draw a panel per budget, a row per scene: the best setting, named beside its error.

    Filled markers are errors against the scene's own full-order run, hollow ones those of the
    full-order run with the best K that fits, against the converged one. Where the scene's own run
    fits the budget, no reduction is needed, and the row says so.
    """
    table = results.table("budget")
    scenes = results.scenes_of(table, options, "no point of accuracy against time")
    table = table[table.scene.isin(scenes)].copy()
    named = table.method.notna()
    table.loc[named, "model"] = [model_name(row) for row in table[named].itertuples()]
    budgets = sorted(table.budget_ms.unique())
    styles = style.method_styles(_models(table))
    figure = style.new_figure(0.29 * len(scenes) + 1.45)
    axes = figure.subplots(1, len(budgets), sharey=True, squeeze=False)[0]
    for ax, budget in zip(axes, budgets, strict=True):
        _draw_budget(ax, table[table.budget_ms == budget], scenes, styles)
        ax.set_title(f"{budget:g} ms a frame")
        ax.set_xlabel("relative error")
    style.label_rows(axes[0], [style.words(scene) for scene in scenes])
    axes[0].set_ylabel("scene")
    looks = {
        results.method_title(method).replace("-iterations", " iterations"): look
        for method, look in styles.items()
    }
    best = style.handle("full order, best K: error against convergence", **_FOM)
    style.legend(figure, [*style.handles(looks, linestyle="none"), best], 3)
    return figure


def model_name(row: Any) -> str:
    """Method of a row; in a position subspace its kind comes first."""
    if row.position_basis == "full":
        return str(row.method)
    subspace = f"{row.position_basis} subspace"
    return subspace if row.method == "full" else f"{subspace}, {row.method}"


def _models(table: pd.DataFrame) -> list[str]:
    """Names of the reduced models that are drawn, in order of first use."""
    rows = table[(table.reference == OWN) & table.method.notna()]
    rows = rows[rows.relative_error_within_horizon > 0.0]
    return list(dict.fromkeys(rows.model))


def _draw_budget(
    ax: Axes, rows: pd.DataFrame, scenes: list[str], styles: dict[str, tuple[str, str]]
) -> None:
    ax.set_xscale("log")
    ax.set_xlim(LOW, HIGH)
    style.grid(ax)
    ax.tick_params(axis="y", length=0)
    for y, scene in enumerate(scenes):
        part = rows[rows.scene == scene].set_index("reference")
        if OWN in part.index:
            _draw_best(ax, y, part.loc[OWN], styles)
        if CONVERGED in part.index and pd.notna(part.method[CONVERGED]):
            best = part.loc[CONVERGED]
            x = clipped(np.array([best.relative_error_within_horizon]), LOW, HIGH)
            ax.plot(x, [y + 0.27], markersize=3.6, clip_on=False, **_FOM)
            _name(ax, x[0], y + 0.27, f"K={best.iterations:.0f}", style.FAILED)


def _draw_best(ax: Axes, y: int, best: pd.Series, styles: dict[str, tuple[str, str]]) -> None:
    if pd.isna(best.method):
        ax.text(LOW * 1.3, y - 0.1, "nothing fits", fontsize=6.5, va="center", color="#777777")
    elif best.relative_error_within_horizon == 0.0:
        ax.text(LOW * 1.3, y - 0.1, FULL, fontsize=6.5, va="center", color="#444444")
    else:
        colour, marker = styles[best.model]
        x = clipped(np.array([best.relative_error_within_horizon]), LOW, HIGH)
        look = {"color": colour, "marker": marker, "linestyle": "none"}
        ax.plot(x, [y - 0.1], markersize=5.0, clip_on=False, **look)
        _name(ax, x[0], y - 0.1, _setting(best), "#333333")


def _setting(best: pd.Series) -> str:
    """Size of the best setting in a few letters."""
    if best.method == FEWER:
        return f"K={best.iterations:.0f}"
    if pd.notna(best.k):
        return f"k={best.k:.0f}" + (f", {best.r:.0f} el." if best.method != "full" else "")
    return f"r={best.r:.0f}"


def _name(ax: Axes, x: float, y: float, text: str, colour: str) -> None:
    """Text beside a marker, on the side with more room."""
    right = x < np.sqrt(LOW * HIGH) * 10.0
    ax.annotate(
        text, (x, y), (5.0 if right else -5.0, 0.0), textcoords="offset points", fontsize=6.2,
        va="center", ha="left" if right else "right", color=colour,
    )  # fmt: skip
