"""Figures of singular values of the snapshots, and of reconstruction errors by basis size."""

from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.multiples import clipped, label_outer, log_axis, small_multiples
from study.artifact.reads import ProjectFile, TableOf
from study.figures.kit.declaration import Beside, Drawn, Experiment, Methods, NothingToDraw, figure

VALUES = (1e-17, 3.0)
ERRORS = (1e-7, 1e3)  # limits of the error axis; errors outside are drawn on them
PUBLISHED = "#B5B5B5"
PUBLISHED_CODE = "config/reference/published_code"
REGION = "#F1EFEB"
HOLLOW = {"markerfacecolor": "white", "markeredgecolor": "#777777"}
Panel = tuple[Axes, Experiment, pd.DataFrame]


class Reconstruction(Beside, Methods):
    """Options: scenes, methods, panels per row, and experiments of the published code."""


def _panels(
    options: Beside, drawn: Drawn, table: pd.DataFrame, limits: tuple[float, float], legend: int
) -> tuple[Figure, list[Panel]]:
    """Figure with a panel per experiment in ``table`` and space for ``legend`` lines below."""
    pairs = [
        (each, rows)
        for each in drawn.experiments
        if len(rows := table[(table.scene == each.scene) & (table.group == each.group)])
    ]
    if not pairs:
        raise NothingToDraw(f"no experiment of {options.words()}")
    figure, axes = small_multiples(len(pairs), options.columns, legend_rows=legend)
    for ax, (each, _) in zip(axes, pairs, strict=True):
        log_axis(ax, *limits)
        ax.set_title(each.title)
    return figure, [(ax, *pair) for ax, pair in zip(axes, pairs, strict=True)]


def _published(path: Path, columns: list[str], options: Beside, each: Experiment) -> pd.DataFrame:
    """Rows of the published code's output ``path`` for ``each`` experiment; may be empty."""
    output = read_table(path, ["experiment", "group", *columns], result=False)
    name = options.published.get(each.scene)
    return output[(output.experiment == name) & (output.group == each.group)]


@figure(
    number=9,
    title="Decay of the singular values",
    caption="""Singular values of the training snapshots, relative to the first. Hollow ones lie
    below the round-off of the projections and are noise. Grey lines are the output of the published
    code for the scene that comes closest.""",
    reads={
        "table": TableOf("singular_values"),
        "published": ProjectFile(f"{PUBLISHED_CODE}/singular_values.csv"),
    },
)
def singular_values(options: Beside, drawn: Drawn, table: pd.DataFrame, published: Path) -> Figure:
    """Draw a panel per experiment: singular values relative to the first one.

    Values that are pure round-off are hollow, and the region below the round-off is shaded.
    """
    figure, panels = _panels(options, drawn, table, VALUES, legend=2)
    reference = False
    for ax, each, rows in panels:
        output = _published(published, ["component", "singular_value"], options, each)
        values = output.sort_values("component").singular_value.to_numpy(float)
        if len(values) and values[0] > 0.0:
            reference = True
            shown = np.clip(values / values[0], VALUES[0], None)
            ax.plot(np.arange(1, len(values) + 1), shown, color=PUBLISHED, linewidth=0.9, zorder=1)
        _draw_values(ax, rows.sort_values("component"), *drawn.looks[each.group])
    label_outer([ax for ax, *_ in panels], options.columns, "component", "singular value / first")
    groups = dict.fromkeys(each.group for _, each, _ in panels)
    handles = style.handles({style.words(group): drawn.looks[group] for group in groups})
    handles.append(style.handle("below round-off", linestyle="none", marker="o", **HOLLOW))
    if reference:
        handles.append(style.handle("published code's output", color=PUBLISHED))
    style.legend(figure, handles, 4)
    return figure


def _draw_values(ax: Axes, rows: pd.DataFrame, colour: str, marker: str) -> None:
    """Draw singular values; values that are round-off are hollow, in a shaded region.

    The region ends between the smallest value above round-off and the largest at round-off.
    """
    component = rows.component.to_numpy(float)
    above = rows.above_roundoff.astype(bool).to_numpy()
    # zeros cannot be drawn on a logarithmic axis and are raised to its lower limit
    shown = np.clip(np.nan_to_num(rows.relative.to_numpy(float)), VALUES[0], None)
    if not above.all():
        limit = np.sqrt(shown[~above].max() * shown[above].min()) if above.any() else VALUES[1]
        ax.axhspan(VALUES[0], limit, color=REGION, linewidth=0.0, zorder=0)
        words = {"fontsize": 7.5, "color": "#6B675F", "style": "italic"}
        text = "round-off" if above.any() else "all of it round-off"
        ax.text(0.03, 0.04, text, transform=ax.transAxes, **words)
    ax.plot(component[above], shown[above], color=colour, linewidth=0.8)
    for mask, marks in ((above, {"color": colour}), (~above, HOLLOW | {"markeredgewidth": 0.5})):
        if mask.any():
            ax.plot(
                component[mask], shown[mask], linestyle="none", marker=marker, markersize=2.8,
                clip_on=False, **marks,
            )  # fmt: skip
    ax.set_xlim(0, 1.02 * max(component.max(), 1.0))


@figure(
    number=8,
    title="Reconstruction error of three scenes of the preprint",
    caption="""Relative error of reconstructed projections against the number $r$ of basis vectors,
    for the snapshots used (train), the frames between them (test) and another run (held out).
    Errors above the axis are drawn on its rim with an arrow head.""",
    reads={
        "table": TableOf("reconstruction_error"),
        "published": ProjectFile(f"{PUBLISHED_CODE}/reconstruction_error.csv"),
    },
)
def reconstruction_error(
    options: Reconstruction, drawn: Drawn, table: pd.DataFrame, published: Path
) -> Figure:
    """Draw a panel per experiment with the error of each method and split over the basis size.

    If an experiment has no errors because its projections are round-off, its panel has a note. The
    published code's table has errors of the x and y axes, but no total error.
    """
    methods = [m for m in drawn.methods if (table.method == m).any()]
    if not methods:
        raise NothingToDraw(f"reconstruction errors of {options.words()}")
    figure, panels = _panels(options, drawn, table, ERRORS, legend=3)
    reference = False
    for ax, each, rows in panels:
        columns = ["split", "num_points", "relative_error_x"]
        output = _published(published, columns, options, each)
        output = output[output.split == "train"].sort_values("num_points")
        for axis in ("x", "y") if len(output) else ():
            reference = True
            error = clipped(output[f"relative_error_{axis}"].to_numpy(float), *ERRORS)
            ax.plot(output.num_points, error, color=PUBLISHED, linewidth=0.7, zorder=1)
        lines = [_draw_method(ax, rows[rows.method == m], m) for m in methods]
        if not any(lines):
            ax.text(
                0.5, 0.5, "projections are round-off:\nno relative error exists",
                transform=ax.transAxes, ha="center", va="center", color="#666666",
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 2},
            )  # fmt: skip
        ax.set_xlim(0, max(float(rows.r.max()), 1.0) * 1.02)
    label_outer([ax for ax, *_ in panels], options.columns, "basis size r", "relative error")
    handles = drawn.handles(style.method_styles(methods)) + style.split_handles(style.SPLITS)
    if reference:
        label = "published code's output (x, y)"
        handles.append(style.handle(label, color=PUBLISHED, linewidth=1.0))
    style.legend(figure, handles, 4)
    return figure


def _draw_method(ax: Axes, rows: pd.DataFrame, method: str) -> bool:
    """Draw the errors of ``method``, with arrows for larger ones; return whether it has any."""
    colour, marker = style.method_styles([method])[method]
    drawn = False
    for split, dashes in style.SPLITS.items():
        line = rows[rows.split == split].sort_values("r")
        error = line.relative_error.to_numpy(float)
        if not np.isfinite(error).any():
            continue
        drawn, train = True, split == "train"
        shown = clipped(np.where(np.isfinite(error), error, np.nan), *ERRORS)
        ax.plot(
            line.r, shown, linestyle=dashes, color=colour, linewidth=1.2 if train else 0.9,
            marker=marker if train else None, markersize=2.8,
            markevery=max(1, len(shown) // 5), clip_on=False,
        )  # fmt: skip
        above = error > ERRORS[1]
        if train and above.any():
            ax.plot(
                line.r[above], np.full(above.sum(), ERRORS[1]), linestyle="none", marker=6,
                markersize=5, color=colour, clip_on=False, zorder=5,
            )  # fmt: skip
    return drawn
