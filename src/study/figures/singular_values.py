"""Decay of the singular values of the snapshot matrices."""

from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.multiples import label_outer, log_axis, small_multiples
from study.artifact.reads import ProjectFile, Settings, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Beside, Columns, Drawn, Experiments, NothingToDraw

LOW, HIGH = 1e-17, 3.0
PUBLISHED = "#B5B5B5"
PUBLISHED_VALUES = "config/reference/published_code/singular_values.csv"
REGION = "#F1EFEB"
PUBLISHED_COLUMNS = ["experiment", "group", "component", "singular_value"]


class Options(Experiments, Columns, Beside):
    """Options of the figure."""


@figure(
    number=9,
    title="Decay of the singular values",
    caption=(
        "Singular values of the training snapshots, relative to the first. Hollow ones lie below "
        "the round-off of the projections and are noise. Grey lines are the output of the "
        "published code for the scene that comes closest."
    ),
    reads={
        "drawn": Settings(Drawn),
        "table": TableOf("singular_values"),
        "published": ProjectFile(PUBLISHED_VALUES),
    },
    options=Options,
)
def singular_values(options: Options, drawn: Drawn, table: pd.DataFrame, published: Path) -> Figure:
    """Draw a panel per experiment: singular values relative to the first one.

    Values that are pure round-off are hollow, and the region below the round-off is shaded.
    """
    pairs = [
        (each, rows.sort_values("component"))
        for each in drawn.experiments
        if len(rows := table[(table.scene == each.scene) & (table.group == each.group)])
    ]
    if not pairs:
        raise NothingToDraw(f"singular values of {options.words()}")
    looks = drawn.looks
    output = read_table(published, PUBLISHED_COLUMNS, result=False)
    figure, axes = small_multiples(len(pairs), options.columns, legend_rows=2)
    reference_drawn = False
    for ax, (each, rows) in zip(axes, pairs, strict=True):
        log_axis(ax, LOW, HIGH)
        if experiment := options.published.get(each.scene):
            reference_drawn |= _draw_published(ax, output, experiment, each.group)
        _draw_values(ax, rows, looks[each.group])
        ax.set_title(each.title)
    label_outer(axes, options.columns, "component", y="singular value / first")
    _legend(figure, {each.group: looks[each.group] for each, _ in pairs}, reference_drawn)
    return figure


def _draw_values(ax: Axes, rows: pd.DataFrame, look: tuple[str, str]) -> None:
    component = rows.component.to_numpy(float)
    relative = rows.relative.to_numpy(float)
    above = rows.above_roundoff.astype(bool).to_numpy()
    # exact zeros have no place on a logarithmic axis; they lie on its lower rim
    shown = np.clip(np.nan_to_num(relative), LOW, None)
    colour, marker = look
    _shade_roundoff(ax, shown, above)
    ax.plot(component[above], shown[above], color=colour, linewidth=0.8)
    hollow = {"markerfacecolor": "white", "markeredgecolor": "#777777", "markeredgewidth": 0.5}
    for mask, marks in ((above, {"color": colour}), (~above, hollow)):
        if mask.any():
            ax.plot(
                component[mask], shown[mask], linestyle="none", marker=marker, markersize=2.8,
                clip_on=False, **marks,
            )  # fmt: skip
    ax.set_xlim(0, 1.02 * max(component.max(), 1.0))


def _shade_roundoff(ax: Axes, shown: np.ndarray, above: np.ndarray) -> None:
    """Shade up to between the smallest true value and the largest one that is round-off."""
    if above.all():
        return
    noise = shown[~above].max()
    limit = np.sqrt(noise * shown[above].min()) if above.any() else HIGH
    ax.axhspan(LOW, limit, color=REGION, linewidth=0.0, zorder=0)
    text = "round-off" if above.any() else "all of it round-off"
    ax.text(0.03, 0.04, text, transform=ax.transAxes, fontsize=7.5, color="#6B675F", style="italic")


def _draw_published(ax: Axes, table: pd.DataFrame, experiment: str, group: str) -> bool:
    rows = table[(table.experiment == experiment) & (table.group == group)]
    values = rows.sort_values("component").singular_value.to_numpy(float)
    if len(values) == 0 or values[0] <= 0.0:
        return False
    ax.plot(
        np.arange(1, len(values) + 1), np.clip(values / values[0], LOW, None),
        color=PUBLISHED, linewidth=0.9, zorder=1,
    )  # fmt: skip
    return True


def _legend(figure: Figure, looks: dict[str, tuple[str, str]], published: bool) -> None:
    handles = style.handles({style.words(group): look for group, look in looks.items()})
    handles.append(
        style.handle(
            "below round-off", linestyle="none", marker="o", markerfacecolor="white",
            markeredgecolor="#777777",
        )
    )  # fmt: skip
    if published:
        handles.append(style.handle("published code's output", color=PUBLISHED))
    style.legend(figure, handles, 4)
