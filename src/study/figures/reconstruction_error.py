"""Reconstruction error of snapshots against the basis size, on the preprint's scenes."""

from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.multiples import clipped, label_outer, log_axis, small_multiples
from study.artifact.reads import ProjectFile, Settings, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, NothingToDraw, Reconstruction

LOW, HIGH = 1e-7, 1e3  # errors outside are drawn on the limit
PUBLISHED = "#B5B5B5"
PUBLISHED_ERRORS = "config/reference/published_code/reconstruction_error.csv"
PUBLISHED_COLUMNS = ["experiment", "group", "split", "num_points", "relative_error_x"]


@figure(
    number=8,
    title="Reconstruction error of three scenes of the preprint",
    caption=(
        "Relative error of reconstructed projections against the number $r$ of basis vectors, for "
        "the snapshots used (train), the frames between them (test) and another run (held out). "
        "Errors above the axis are drawn on its rim with an arrow head."
    ),
    reads={
        "drawn": Settings(Drawn),
        "table": TableOf("reconstruction_error"),
        "published": ProjectFile(PUBLISHED_ERRORS),
    },
    options=Reconstruction,
)
def reconstruction_error(
    options: Reconstruction, drawn: Drawn, table: pd.DataFrame, published: Path
) -> Figure:
    """Draw a panel per experiment, a line per method and split; errors outside lie on the rim.

    An experiment without any error (its projections are round-off) has a panel that says so.
    """
    pairs = [
        (each, rows)
        for each in drawn.experiments
        if len(rows := table[(table.scene == each.scene) & (table.group == each.group)])
    ]
    methods = [m for m in drawn.methods if (table.method == m).any()]
    if not pairs or not methods:
        raise NothingToDraw(f"reconstruction errors of {options.words()}")
    output = read_table(published, PUBLISHED_COLUMNS, result=False)
    figure, axes = small_multiples(len(pairs), options.columns, legend_rows=3)
    reference_drawn = False
    for ax, (each, rows) in zip(axes, pairs, strict=True):
        log_axis(ax, LOW, HIGH)
        if experiment := options.published.get(each.scene):
            reference_drawn |= _draw_published(ax, output, experiment, each.group)
        lines = [_draw_method(ax, rows, method, options.splits) for method in methods]
        if not any(lines):
            style_note(ax, "projections are round-off:\nno relative error exists")
        ax.set_title(each.title)
        ax.set_xlim(0, max(float(rows.r.max()), 1.0) * 1.02)
    label_outer(axes, options.columns, "basis size r", y="relative error")
    _legend(figure, drawn, methods, options.splits, reference_drawn)
    return figure


def _draw_method(ax: Axes, rows: pd.DataFrame, method: str, splits: tuple[str, ...]) -> bool:
    colour, marker = style.method_styles([method])[method]
    drawn = False
    for split in splits:
        line = rows[(rows.method == method) & (rows.split == split)].sort_values("r")
        error = line.relative_error.to_numpy(float)
        if not np.isfinite(error).any():
            continue
        drawn = True
        shown = clipped(np.where(np.isfinite(error), error, np.nan), LOW, HIGH)
        train = split == "train"
        ax.plot(
            line.r, shown, linestyle=style.SPLITS[split], color=colour,
            linewidth=1.2 if train else 0.9, marker=marker if train else None, markersize=2.8,
            markevery=max(1, len(shown) // 5), clip_on=False,
        )  # fmt: skip
        if train:
            _mark_clipped(ax, line.r.to_numpy(float), error, colour)
    return drawn


def _mark_clipped(ax: Axes, r: np.ndarray, error: np.ndarray, colour: str) -> None:
    """Arrow heads on the upper rim where the error lies above it."""
    above = error > HIGH
    if above.any():
        ax.plot(
            r[above], np.full(above.sum(), HIGH), linestyle="none", marker=6, markersize=5,
            color=colour, clip_on=False, zorder=5,
        )  # fmt: skip


def style_note(ax: Axes, text: str) -> None:
    """Write a grey remark ``text`` in the middle of a panel ``ax``."""
    ax.text(
        0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color="#666666",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 2},
    )  # fmt: skip


def _draw_published(ax: Axes, table: pd.DataFrame, experiment: str, group: str) -> bool:
    """Errors of the x and y axes on the training snapshots: the published table has no total."""
    rows = table[
        (table.experiment == experiment) & (table.group == group) & (table.split == "train")
    ].sort_values("num_points")
    for axis in ("x", "y"):
        error = clipped(rows[f"relative_error_{axis}"].to_numpy(float), LOW, HIGH)
        ax.plot(rows.num_points, error, color=PUBLISHED, linewidth=0.7, zorder=1)
    return len(rows) > 0


def _legend(
    figure: Figure, drawn: Drawn, methods: list[str], splits: tuple[str, ...], published: bool
) -> None:
    handles = drawn.handles(style.method_styles(methods))
    handles += style.split_handles(splits)
    if published:
        label = "published code's output (x, y)"
        handles.append(style.handle(label, color=PUBLISHED, linewidth=1.0))
    style.legend(figure, handles, 4)
