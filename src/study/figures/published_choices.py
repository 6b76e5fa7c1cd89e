"""Reconstruction errors on the way from this study's `published` to the published code's output."""

import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure, Line2D
from pdrom.view.multiples import label_outer, log_axis, small_multiples
from study.artifact.reads import TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Scenes
from study.figures.kit.results import NothingToDraw, Results

LOW, HIGH = 1e-2, 1e4  # limits of the axis
PANELS = 3  # in a row


@figure(
    title="This study's error and the published code's, choice by choice",
    caption=(
        "Relative error of the reconstructed training snapshots, $x$ components, against the "
        "number $r$ of basis vectors. Grey: what the published code wrote itself. Dashed: the "
        "method with its choices of basis and rows, as in this study. Green: with one more of its "
        "choices, the one that alone leads closest and that stands above. Blue: with all of them. "
        "The pale band holds "
        "all runs in which what rounding decides is drawn at random: the signs of the modes, or "
        "which of several rows with equal residuals is picked; dotted, the closest of these runs."
    ),
    reads=(TableOf("published_choices"), TableOf("published_distance")),
    options=Scenes,
)
def published_choices(results: Results, options: Scenes) -> Figure:
    """Draw a panel for each case, with the first and the last of its choices that add up."""
    table = results.asked_rows("published_choices", options)
    distances = results.table("published_distance")
    table = table[table.axis == "x"]
    if table.empty:
        raise NothingToDraw("no scene that the published code's output is stored of")
    cases = list(table.groupby(["scene", "group"], sort=False))
    figure, axes = small_multiples(len(cases), PANELS, legend_rows=2)
    handles: dict[str, Line2D] = {}
    for ax, ((scene, group), rows) in zip(axes, cases, strict=True):
        log_axis(ax, LOW, HIGH)
        own = distances[(distances.scene == scene) & (distances.group == group)]
        _draw_case(ax, rows, own)
        ax.set_title(results.experiment_title(scene, group))
        handles |= {str(line.get_label()): line for line in ax.get_lines()}
    label_outer(axes, PANELS, "basis size r", y="relative error (x)")
    style.legend(figure, list(handles.values()), 3)
    return figure


def _draw_case(ax: Axes, rows: pd.DataFrame, distances: pd.DataFrame) -> None:
    drawn = rows[rows.direction.isin(["signs", "ties"])].groupby("r").error
    if len(drawn):
        ax.fill_between(
            drawn.min().index, drawn.min(), drawn.max(), color=style.BLUE, alpha=0.15, linewidth=0
        )
    steps = rows[rows.direction == "cumulative"]
    names = list(dict.fromkeys(steps.choice))
    reference = steps[steps.choice == names[0]]
    ax.plot(reference.r, reference.reference, color=style.GREY, linewidth=3.0,
            label="published code's output")  # fmt: skip
    _line(ax, reference, names[0], color=style.PURPLE, linestyle="--", marker="v")
    alone = distances[distances.direction == "alone"]
    if alone.distance.notna().any():
        closest = alone.loc[alone.distance.idxmin(), "choice"]
        line = rows[(rows.direction == "alone") & (rows.choice == closest)]
        _line(ax, line, "only the choice named above", color=style.GREEN, marker="s")
        ax.text(0.98, 0.96, closest, color=style.GREEN, size="x-small", ha="right", va="top",
                transform=ax.transAxes)  # fmt: skip
    _line(ax, steps[steps.choice == names[-1]], "all its choices", color=style.BLUE, marker="o")
    draws = distances[distances.direction.isin(["signs", "ties"])]
    if draws.distance.notna().any():
        direction, choice = draws.loc[draws.distance.idxmin(), ["direction", "choice"]]
        line = rows[(rows.direction == direction) & (rows.choice == choice)]
        _line(ax, line, "closest of the draws", color=style.BLACK, linestyle=":", marker=".")


def _line(ax: Axes, rows: pd.DataFrame, label: str, **look: str) -> None:
    shown = rows.error.clip(LOW, HIGH)
    ax.plot(rows.r, shown, linewidth=1.0, markersize=2.8, label=label, **look)
