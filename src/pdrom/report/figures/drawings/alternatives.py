"""What else there is: error against time of the alternatives to projective dynamics."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pdrom.experiments.alternatives.settings import CONVERGED, REDUCED
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import clipped, log_axis, time_axis
from pdrom.report.figures.kit.options import Scenes
from pdrom.report.figures.kit.results import NothingToDraw, Results

COLUMNS = [
    "scene", "vertices", "stiffness", "method", "substeps", "ms_per_frame", "error_implicit",
    "error_continuous",
]  # fmt: skip
LOW, HIGH = 1e-4, 1.0  # errors outside are drawn on the limit
PAIRS = 2  # cases side by side
LOOKS = {
    "projective": ("projective dynamics", style.BLACK, "o"),
    "anderson": ("with Anderson acceleration", style.GREY, "s"),
    "l-bfgs": ("L-BFGS", style.BLUE, "^"),
    "newton": ("projected Newton", style.PURPLE, "D"),
    "xpbd": ("XPBD", style.ORANGE, "v"),
    "vertex-descent": ("vertex block descent", style.SKY, "P"),
    "explicit": ("explicit (Verlet)", style.VERMILLION, "X"),
    REDUCED: ("POD subspace, ecsw", style.GREEN, "*"),
}


def draw(results: Results, options: Scenes) -> Figure:
    """A pair of panels for each scene, mesh and stiffness.

    Raises
    ------
    StorageError
        The table is missing or lacks a column.
    """
    table = results.table("alternatives", COLUMNS)
    asked = options.scenes or tuple(dict.fromkeys(table.scene))
    cases = list(table[table.scene.isin(asked)].groupby(["scene", "vertices", "stiffness"]))
    if not cases:
        raise NothingToDraw("no alternatives")
    beside = min(PAIRS, len(cases))
    lines = -(-len(cases) // beside)
    figure = Figure(figsize=(style.WIDTH, 1.75 * lines + 0.75), layout="constrained")
    axes = figure.subplots(lines, 2 * beside, squeeze=False, sharey=True)
    for ax in axes.ravel()[2 * len(cases) :]:
        ax.remove()
    pairs = axes.reshape(-1, 2)
    for number, ((labels, case), pair) in enumerate(zip(cases, pairs, strict=False)):
        _draw_case(pair, labels, case)
        if number + beside >= len(cases):
            for ax in pair:
                ax.set_xlabel("ms a frame")
    for line in axes:
        line[0].set_ylabel("relative error")
    handles = [
        Line2D([], [], color=colour, marker=marker, markersize=4, label=label)
        for method, (label, colour, marker) in LOOKS.items()
        if (table.method == method).any()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _draw_case(pair: np.ndarray, labels: tuple[str, int, float], case: pd.DataFrame) -> None:
    scene, vertices, stiffness = labels
    stiff = "" if stiffness == 1.0 else rf" $\times {stiffness:g}$"
    name = f"{style.words(scene)}{stiff}, {vertices:,} vertices"
    for ax, reference in zip(pair, ("implicit", "continuous"), strict=True):
        log_axis(ax, LOW, HIGH)
        time_axis(ax, case.ms_per_frame.to_numpy(float))
        kind = "implicit step" if reference == "implicit" else "total error"
        ax.set_title(f"{name}\n{kind}", fontsize=7)
        rows = case.assign(error=case[f"error_{reference}"]).dropna(subset="error")
        own = rows[rows.method == CONVERGED]
        if reference == "continuous" and len(own):
            ax.axhline(own.error.iloc[0], color="#555555", linestyle="--", linewidth=0.8)
        for method, (_, colour, marker) in LOOKS.items():
            _draw_best(ax, best_points(rows[rows.method == method]), colour, marker)


def best_points(rows: pd.DataFrame) -> pd.DataFrame:
    """Points that no other one beats in time and error, from the cheapest to the most accurate."""
    ordered = rows.sort_values(["ms_per_frame", "error"], kind="stable")
    before = ordered.error.cummin().shift(fill_value=np.inf)
    return ordered[ordered.error < before]


def _draw_best(ax: Axes, points: pd.DataFrame, colour: str, marker: str) -> None:
    errors = clipped(points.error.to_numpy(float), LOW, HIGH)
    ax.plot(points.ms_per_frame, errors, color=colour, linewidth=0.9)
    divided = (points.substeps > 1).to_numpy(bool)
    for chosen, face in ((~divided, colour), (divided, "white")):
        ax.plot(
            points.ms_per_frame[chosen], errors[chosen], color=colour, marker=marker,
            markerfacecolor=face, linestyle="none", markersize=3.6, markeredgewidth=0.8,
        )  # fmt: skip
