"""Phases of an iteration against the bounds of the machine."""

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact.reads import TableOf
from study.experiments.kit.names import GLOBAL, RIGHT
from study.experiments.roofline.bound import MEMORY, READ
from study.figures.kit.declaration import figure
from study.figures.kit.legends import group_looks
from study.figures.kit.options import Scenes
from study.figures.kit.results import NothingToDraw, Results
from study.tables.roofline import WHOLE

OTHERS = {RIGHT: (style.GREY, "x"), GLOBAL: ("#3A5A78", "*")}
SHARES = (1.0, 0.5, 0.2, 0.1)


@figure(
    title="An iteration against the bound of the machine",
    caption=(
        "Left: bytes read a second by one thread against the working set (median and quartiles), "
        "with the smallest cache that holds it; ticks below are the working sets of the scenes' "
        "iterations. Right: time of each phase of an iteration, on the scenes' own meshes and on "
        "finer ones, against its bound: the longest of the times for bytes (with the vectors that "
        "gathers and scatters move), for sums and products, "
        "and for divisions and roots. Filled markers are bound by bytes, hollow ones by "
        "arithmetic. "
        "Points below the diagonal are due to the spread of the measurement."
    ),
    reads=(TableOf("machine_rates"), TableOf("roofline")),
    options=Scenes,
)
def roofline(results: Results, options: Scenes) -> Figure:
    """Draw the bandwidth, and beside it measured times over bounds."""
    rates = results.table("machine_rates")
    phases = results.table("roofline")
    phases = phases[phases.scene.isin(results.scenes(options))]
    timed = phases[(phases.phase != WHOLE) & (phases.measured_us > 0.0)]
    if timed.empty or rates.empty:
        raise NothingToDraw("no phase of an iteration was timed")
    looks = {**group_looks(results.holdings), **OTHERS}
    figure = style.new_figure(3.4)
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    _draw_bandwidth(left, rates[rates.quantity == READ], phases.working_set.unique())
    shown = [phase for phase in looks if (timed.phase == phase).any()]
    for phase in shown:
        _draw_phase(right, timed[timed.phase == phase], *looks[phase])
    _draw_shares(right, timed)
    named = {style.words(phase): looks[phase] for phase in shown}
    style.legend(figure, style.handles(named, linestyle="none"), min(len(named), 5))
    return figure


def _draw_bandwidth(ax: Axes, rates: pd.DataFrame, used: np.ndarray) -> None:
    rates = rates.sort_values("working_set")
    size = rates.working_set / 2**20
    spread = [rates.rate - rates.low, rates.high - rates.rate]
    ax.set_xscale("log", base=2)
    ax.errorbar(size, rates.rate, yerr=spread, color=style.BLUE, marker="o", capsize=1.5)
    top = 1.12 * float(rates.high.max())
    for level, part in size.groupby(rates.level, sort=False):
        ax.text(float(np.sqrt(part.min() * part.max())), top, str(level), ha="center", va="top")
        if part.min() > size.min():
            ax.axvline(part.min() / np.sqrt(2.0), color="#BBBBBB", linewidth=0.6)
    ax.plot(used / 2**20, np.full(len(used), 0.02 * top), "|", color=style.BLACK, markersize=6)
    ax.set_ylim(0.0, top)
    ax.set_xticks([2.0**k for k in range(-6, 9, 2)], ["16K", "64K", "256K", *_MEBIBYTES])
    ax.set_xlim(size.min() / 1.5, size.max() * 1.5)
    ax.set_xlabel("working set (bytes)")
    ax.set_ylabel("read (GB/s)")
    ax.set_title("bandwidth of one thread")


_MEBIBYTES = ("1M", "4M", "16M", "64M", "256M")


def _draw_phase(ax: Axes, rows: pd.DataFrame, colour: str, marker: str) -> None:
    by_bytes = rows.limit == MEMORY
    for part, face in ((rows[by_bytes], colour), (rows[~by_bytes], "none")):
        ax.scatter(
            part.bound_us, part.measured_us, s=22, marker=marker, linewidths=0.9, alpha=0.85,
            color=colour, facecolors=colour if marker == "x" else face,
        )  # fmt: skip


def _draw_shares(ax: Axes, rows: pd.DataFrame) -> None:
    """Lines of equal share of the bound."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    style.grid(ax)
    low = 0.3 * float(rows[["bound_us", "measured_us"]].min().min())
    high = 1.8 * float(rows[["bound_us", "measured_us"]].max().max())
    ends = np.array([low, high])
    for share in SHARES:
        line = "-" if share == 1.0 else ":"
        ax.plot(ends, ends / share, line, color=style.BLACK, linewidth=0.8, zorder=0)
        at = 1.12 * low
        ax.annotate(
            f"{100 * share:.0f} %", (at, at / share), fontsize=7, ha="left", va="bottom",
            xytext=(0, 3), textcoords="offset points",
        )  # fmt: skip
    ax.set_xlim(low, high)
    ax.set_ylim(low, high)
    ax.set_xlabel("bound of a phase (µs an iteration)")
    ax.set_ylabel("time measured (µs)")
    ax.set_title("phases against their bounds")
