"""Break-even of reduced local steps against the basis size (claim C9)."""

import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.multiples import label_outer, small_multiples
from study.artifact.reads import Settings, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Columns, Drawn, Experiments, Methods, NothingToDraw


class Options(Experiments, Methods, Columns):
    """Options of the figure."""


@figure(
    title="When a reduced local step stops paying",
    caption=(
        "Time of the reduced local step over that of the full one, both compiled and on one "
        "thread, against the number $r$ of basis vectors; one line per scene and method, timed "
        "alone on states of the full-order run. Above the dashed line the reduction costs more "
        "than all projections. Lines end at the numerical rank."
    ),
    reads={"drawn": Settings(Drawn), "table": TableOf("breakeven")},
    options=Options,
)
def break_even(options: Options, drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Draw a panel per constraint group, a line per scene and method; above 1 it costs more."""
    table = drawn.rows(table)
    table = table[table.factor == 1.0]
    if table.empty:
        raise NothingToDraw("no reduced local step was timed")
    groups = [g for g in drawn.looks if (table.group == g).any()]
    figure, axes = small_multiples(len(groups), options.columns, legend_rows=2, height=1.8)
    styles = style.method_styles([m for m in drawn.methods if (table.method == m).any()])
    for ax, group in zip(axes, groups, strict=True):
        _draw_group(ax, table[table.group == group], styles)
        ax.set_title(style.words(group))
    label_outer(axes, options.columns, "basis vectors r", "reduced over full local step")
    one = style.handle("break-even", color=style.BLACK, linestyle="--")
    style.legend(figure, [*drawn.handles(styles), one], 3)
    return figure


def _draw_group(ax: Axes, rows: pd.DataFrame, styles: dict[str, tuple[str, str]]) -> None:
    ax.set_yscale("log")
    style.grid(ax)
    ax.axhline(1.0, color=style.BLACK, linestyle="--", linewidth=1.0, zorder=1)
    for (_, method), curve in rows.groupby(["scene", "method"], sort=False):
        colour, marker = styles[str(method)]
        curve = curve.sort_values("r")
        ax.plot(
            curve.r, curve.ratio, color=colour, marker=marker, markersize=2.6, linewidth=0.8,
            alpha=0.75,
        )  # fmt: skip
    ax.set_xlim(left=0.0)
