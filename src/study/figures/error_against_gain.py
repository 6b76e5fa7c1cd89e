"""Error of a run against the gain of its interpolation, which tells whether it fails."""

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.multiples import clipped, log_axes, rim_arrows
from study.artifact.reads import Settings, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, Experiments, Methods, NothingToDraw
from study.tables.kit.reruns import FAILED, judged_runs

ERRORS, GAINS = (1e-5, 1e2), (1.0, 1e5)  # limits of the axes; points outside are drawn on the rim
ENDS = ("low", "median", "high")
DECADES = 4  # gains above 10^4 are counted together
_KEYS = ["scene", "group", "method", "r"]


class Options(Experiments, Methods):
    """Options of the figure."""


@figure(
    title="Error of the run against the gain",
    caption=(
        "Left: every run of a sampled method whose basis suffices (the orthogonal projection does "
        "not fail at the same size), over all scenes and sizes. Dashed: the error from which on a "
        "run counts as failed. Arrows on the rim lie outside the axes. Crosses: range and median "
        "over runs, in some scenes, that are trained on as many resampled frames. Right: how many "
        "of them failed, by decade of the gain."
    ),
    reads={
        "drawn": Settings(Drawn),
        "reruns": TableOf("reduced_reruns"),
        "errors": TableOf("reconstruction_error"),
        "repetitions": TableOf("repetitions"),
    },
    options=Options,
)
def error_against_gain(
    options: Options,
    drawn: Drawn,
    reruns: pd.DataFrame,
    errors: pd.DataFrame,
    repetitions: pd.DataFrame,
) -> Figure:
    """Draw a dot per run, error within the horizon over gain, and failures by decade of gain.

    Runs that ended before their horizon lie on the upper rim, singular interpolations on the right
    one.
    """
    runs = drawn.rows(judged_runs(reruns, errors))
    if runs.empty:
        raise NothingToDraw("no run with a gain")
    figure = style.new_figure(3.0)
    left, right = figure.subplots(1, 2, width_ratios=(2.2, 1.0))
    ranges = _ranges(repetitions, runs)
    methods = [m for m in drawn.methods if (runs.method == m).any()]
    styles = style.method_styles(methods)
    for method in methods:
        _draw_method(left, runs[runs.method == method], *styles[method])
        _draw_ranges(left, ranges[ranges.method == method], styles[method][0])
    _draw_limits(left)
    _draw_decades(right, runs)
    style.legend(figure, drawn.handles(styles, linestyle="none"), 4)
    return figure


def _draw_method(ax: Axes, runs: pd.DataFrame, colour: str, marker: str) -> None:
    x, y = runs.gain.to_numpy(float), runs.error.to_numpy(float)
    rim_arrows(ax, x, y, colour=colour, across=GAINS, along=ERRORS)
    ax.plot(
        clipped(x, *GAINS), clipped(y, *ERRORS), linestyle="none", color=colour, marker=marker,
        markersize=3.2, alpha=0.7, markeredgewidth=0.0, clip_on=False,
    )  # fmt: skip


def _ranges(repetitions: pd.DataFrame, runs: pd.DataFrame) -> pd.DataFrame:
    """Ranges over other training frames of those of the ``runs`` that were repeated."""
    repeated = repetitions[repetitions.varied == "training"]
    return runs[[*_KEYS, "gain", "error"]].merge(repeated, on=_KEYS)


def _draw_ranges(ax: Axes, ranges: pd.DataFrame, colour: str) -> None:
    """Draw for each run a cross from its least to its largest gain and error, at the medians."""
    gains = [clipped(ranges[f"gain_{e}"].to_numpy(float), *GAINS) for e in ENDS]
    errors = [clipped(ranges[f"error_{e}"].to_numpy(float), *ERRORS) for e in ENDS]
    bars = {"color": colour, "linewidth": 0.9, "zorder": 3}
    ax.vlines(gains[1], errors[0], errors[2], **bars)
    ax.hlines(errors[1], gains[0], gains[2], **bars)


def _draw_limits(ax: Axes) -> None:
    """Axes, and the error above which a run counts as failed."""
    log_axes(ax, GAINS, ERRORS)
    ax.set_xlabel("gain of the interpolation")
    ax.set_ylabel("error within the horizon (relative)")
    ax.axhline(FAILED, color="#333333", linewidth=0.8, linestyle="--", zorder=0)
    ax.text(GAINS[1], FAILED * 1.1, "failed ", ha="right", va="bottom", fontsize=7)
    ax.text(GAINS[0] * 1.1, ERRORS[1] * 0.8, "ended early: upper rim", va="top", fontsize=7)


def _draw_decades(ax: Axes, runs: pd.DataFrame) -> None:
    """Share of failed runs by decade of the gain, the number of runs above each bar."""
    # the last decade holds all that is above, singular interpolations too
    upper = np.ceil(np.log10(runs.gain.clip(upper=10.0**DECADES + 1.0))).clip(lower=1)
    decades = runs.groupby(upper.astype(int)).failed.agg(["size", "mean"])
    places = np.arange(len(decades))
    ax.bar(places, 100.0 * decades["mean"], width=0.7, color=style.FAILED, alpha=0.75)
    for place, count, share in zip(places, decades["size"], decades["mean"], strict=True):
        ax.text(place, 100.0 * share + 1.5, f"{count}", ha="center", fontsize=7)
    ax.set_xticks(places, [_span(decade) for decade in decades.index])
    ax.set_ylim(0, 112)
    ax.set_yticks([0, 25, 50, 75, 100])
    ax.tick_params(axis="x", labelrotation=35)
    ax.set_xlabel("gain of the interpolation")
    ax.set_ylabel("failed runs (%)")
    ax.set_title("number of runs above each bar")
    style.grid(ax)


def _span(upper: int) -> str:
    """Name of the decade that ends at 10 to the power of ``upper``."""
    if upper > DECADES:
        return rf"over $10^{{{DECADES}}}$"
    return rf"$10^{{{upper - 1}}}$ to $10^{{{upper}}}$"
