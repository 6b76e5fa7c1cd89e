"""Accuracy of reduced models against their time per frame, by family and constraint group."""

import numpy as np

from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact.reads import TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.legends import draw_legend, legend_height
from study.figures.kit.options import Methods, Scenes
from study.figures.kit.results import Results
from study.figures.kit.trade_offs import (
    TradeOffs,
    draw_panel,
    group_title,
    handles,
    label_iterations,
    trade_offs,
)

RATES = (60, 30)  # frames per second
LARGE, SMALL = 2.6, 1.6  # inches, heights of panels
LOWEST = 1e-3  # of the axes: what matters here lies above
COLUMNS = 4  # of the legend


class Options(Scenes, Methods):
    """Choices; the first scene is drawn large."""


@figure(
    title="What accuracy costs in time",
    caption=(
        "Error within the horizon against the time per frame of every reduced model, and of the "
        "full-order run with fewer iterations $K$; both against the scene's own full-order run, "
        "whose time is the vertical line. A colour is a family of models, a marker one of its "
        "members (one for all tolerances; hollow: in a subspace of skinning weights), a line the "
        "best trade-offs within the family: further down and further left is better. "
        "The horizontal line is the full-order run's own error, against the converged one: "
        "errors below it cannot be seen. Arrows on the rim are errors outside the axis, crosses "
        "runs that blew up. Below, a scene for each other constraint group."
    ),
    reads=(TableOf("accuracy_cost"), TableOf("reduced_reruns")),
    options=Options,
)
def accuracy_cost(results: Results, options: Options) -> Figure:
    """Draw the first scene large; below it one scene for each other group, the next in order."""
    found, scenes = trade_offs(results, options)
    first, *rest = scenes
    small = list({group_title(results, scene): scene for scene in reversed(rest)}.values())[::-1]
    blocks = handles(found, results)
    heights = [LARGE, *([SMALL] if small else []), legend_height(blocks, COLUMNS)]
    figure = style.new_figure(sum(heights))
    parts = figure.subfigures(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
    ax = parts[0].subplots()
    draw_panel(ax, found, first, results=results, low=LOWEST, size=4.2)
    label_iterations(ax, found, first)
    _draw_rates(ax)
    ax.set_title(f"{group_title(results, first)}: {style.words(first)}")
    ax.set(xlabel="time per frame (ms)", ylabel="relative error")
    if small:
        _draw_small(parts[1].subplots(1, len(small), sharey=True, squeeze=False)[0], found, small,
                    results)  # fmt: skip
    draw_legend(parts[-1], blocks, COLUMNS)
    return figure


def _draw_small(axes: np.ndarray, found: TradeOffs, scenes: list[str], results: Results) -> None:
    for ax, scene in zip(axes, scenes, strict=True):
        draw_panel(ax, found, scene, results=results, low=LOWEST, size=2.4)
        ax.set_title(f"{group_title(results, scene)}:\n{style.words(scene)}")
        ax.set_xlabel("time per frame (ms)")
    axes[0].set_ylabel("relative error")


def _draw_rates(ax: Axes) -> None:
    """Lines of real time, where the axis reaches them; otherwise they are named at its side."""
    high = ax.get_xlim()[1]
    beyond = [rate for rate in RATES if 1e3 / rate >= high]
    for rate in set(RATES) - set(beyond):
        ax.axvline(1e3 / rate, color="#8A857A", linewidth=0.8, linestyle="--", zorder=0)
        _label(ax, 1e3 / rate, f"{rate} fps ")
    if beyond:
        names = ", ".join(str(rate) for rate in beyond)
        _label(ax, high, f"{names} fps \N{RIGHTWARDS ARROW}")


def _label(ax: Axes, x: float, text: str) -> None:
    ax.text(
        x, 0.99, text, transform=ax.get_xaxis_transform(), fontsize=6.5, va="top", ha="right",
        color="#6B675F",
    )  # fmt: skip
