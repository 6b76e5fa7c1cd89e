"""Panels of error against time per frame: models by family, and the best trade-offs of each."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Axes, Line2D
from pdrom.view.multiples import clipped, label_counts, log_axis, time_axis
from study.experiments.kit.names import ANDERSON, FOM
from study.figures.kit.families import FAMILIES, ITERATIONS, Family, Model, markers
from study.figures.kit.options import Options
from study.figures.kit.results import Results
from study.tables.accuracy_cost import FEWER, pareto

ERROR, TIME = "relative_error_within_horizon", "ms_per_frame"
LOW, HIGH = 1e-4, 1e2  # errors outside are arrows on the rim
ABOVE, BELOW, BLOWN_UP = 6, 7, "x"  # markers: carets, and a cross
OWN = {"color": style.GREY, "linewidth": 1.2}
BLIND = {"color": style.FAILED, "linewidth": 0.9, "linestyle": "-."}


@dataclass(frozen=True)
class TradeOffs:
    """Points of every scene.

    points : rows of the table accuracy_cost whose errors are against the scene's own run
    blown_up : reduced runs that ended before they had an error
    own_ms : scene -> time per frame of its own full-order run
    own_error : scene -> that run's own error, against the converged one
    """

    points: pd.DataFrame
    blown_up: pd.DataFrame
    own_ms: dict[str, float]
    own_error: dict[str, float]
    marker: dict[Model, str]

    def models(self, family: Family, results: Results) -> list[Model]:
        """Models of a ``family`` by ``results``, in the order of the table."""
        return [model for model in self.marker if model.family(results) == family]


def trade_offs(results: Results, options: Options) -> tuple[TradeOffs, list[str]]:
    """Points of the scenes of ``results`` that ``options`` choose, and these scenes.

    Raises
    ------
    NothingToDraw
        No reduced model has both an error and a time.
    StorageError
        A table is missing or lacks a column.
    """
    table = results.table("accuracy_cost").dropna(subset=[ERROR, TIME])
    runs = results.table("reduced_reruns")
    own = (table.method == "full") & (table.position_basis == "full")
    full = table[own].set_index("scene")
    fom = table[table.method == FOM].set_index(["scene", "iterations"])[ERROR]
    errors = {s: float(fom[s, k]) for s, k in full.iterations.items() if (s, k) in fom}
    shown = (table[TIME] > 0.0) & ~own & ~table.method.isin([FOM, ANDERSON])
    points = _drawn(table[shown], results)
    blown_up = runs[(runs.blowup_frame >= 0) & runs[ERROR].isna() & (runs[TIME] > 0.0)]
    scenes = results.scenes_of(points, options, "no reduced model with both an error and a time")
    points = points[points.scene.isin(scenes)]
    names = dict.fromkeys(zip(points.method, points.position_basis, strict=True))
    marker = markers([Model(*name) for name in names if name[0] != FEWER], results)
    found = TradeOffs(points, _drawn(blown_up, results), dict(full[TIME]), errors, marker)
    return found, scenes


def _drawn(table: pd.DataFrame, results: Results) -> pd.DataFrame:
    """Rows of models that are drawn, with their family."""
    names = zip(table.method, table.position_basis, strict=True)
    families = [Model(*name).family(results) for name in names]
    kept = np.array([family is not None for family in families], dtype=bool)
    return table[kept].assign(family=[family.title for family in families if family])


def draw_panel(
    ax: Axes, found: TradeOffs, scene: str, results: Results, low: float = LOW, size: float = 3.0
) -> None:
    """Draw a scene's points, the front of each family, and the full-order run that they replace.

    ``ax`` gets those ``found``, with markers of ``size`` and families by ``results``.

    An error below ``low`` or above `HIGH` is an arrow on the rim; a run that blew up, a cross on
    the upper one.
    """
    ax.set_xscale("log")
    log_axis(ax, low, HIGH)
    rows = found.points[found.points.scene == scene]
    lost = found.blown_up[found.blown_up.scene == scene]
    for family in FAMILIES:
        part = rows[rows.family == family.title]
        for model in found.models(family, results):
            own = (part.method == model.method) & (part.position_basis == model.position_basis)
            fill = "none" if model.hollow else "full"
            _points(ax, part[own], family.colour, found.marker[model], low, size, fill)
        if family == ITERATIONS:
            _points(ax, part, family.colour, "X", low, size)
        _front(ax, part, family.colour, low)
        ended = lost[lost.family == family.title]
        ax.plot(
            ended[TIME], np.full(len(ended), 0.6 * HIGH), BLOWN_UP, color=family.colour,
            markersize=6.0, markeredgewidth=1.8,
        )  # fmt: skip
    times = [*rows[TIME], *lost[TIME], found.own_ms.get(scene, np.nan)]
    time_axis(ax, np.asarray(times, dtype=float))
    if scene in found.own_ms:
        ax.axvline(found.own_ms[scene], zorder=0, **OWN)
    if scene in found.own_error:
        ax.axhline(np.clip(found.own_error[scene], low, HIGH), zorder=0, **BLIND)


def _points(
    ax: Axes,
    rows: pd.DataFrame,
    colour: str,
    marker: str,
    low: float,
    size: float,
    fill: Literal["full", "none"] = "full",
) -> None:
    error, time = rows[ERROR].to_numpy(float), rows[TIME].to_numpy(float)
    looks = ((error < low, BELOW), (error > HIGH, ABOVE))
    inside = (error >= low) & (error <= HIGH)
    common = {"linestyle": "none", "color": colour, "alpha": 0.75, "markeredgewidth": 0.9}
    ax.plot(time[inside], error[inside], marker=marker, markersize=size, fillstyle=fill, **common)
    for outside, arrow in looks:
        if outside.any():
            rim = clipped(error[outside], low, HIGH)
            ax.plot(time[outside], rim, marker=arrow, markersize=size + 2.5, **common)


def _front(ax: Axes, rows: pd.DataFrame, colour: str, low: float) -> None:
    unbeaten = np.array(pareto(rows[ERROR].to_list(), rows[TIME].to_list()), dtype=bool)
    best = rows[unbeaten].sort_values(TIME)
    heights = clipped(best[ERROR].to_numpy(float), low, HIGH)
    ax.plot(best[TIME], heights, color=colour, linewidth=1.3, drawstyle="steps-post", zorder=1.5)


def label_iterations(ax: Axes, found: TradeOffs, scene: str) -> None:
    """Write the number of iterations beside each run of ``scene`` that stops earlier.

    ``ax`` shows those ``found``; near ones share a label.
    """
    rows = found.points[(found.points.scene == scene) & (found.points.method == FEWER)]
    rows = rows.sort_values(TIME)
    label_counts(ax, rows[TIME], rows[ERROR], counts=rows.iterations, prefix="K = ")


def group_title(results: Results, scene: str) -> str:
    """Constraint group that ``scene`` of ``results`` reduces, in words."""
    groups = results.holdings.scenes[scene].groups
    return style.words(groups[0]) if len(groups) == 1 else "several groups"


def handles(found: TradeOffs, results: Results) -> list[tuple[str, list[Line2D]]]:
    """Legend entries of those ``found`` by family of ``results``: a colour, a marker a title."""
    common = {"linewidth": 1.0, "markersize": 4.0}
    entries = [
        ("full order", [
            style.handle("K iterations", color=ITERATIONS.colour, marker="X", **common),
            style.handle("its time", **OWN),
            style.handle("its own error", **BLIND),
        ]),
    ]  # fmt: skip
    for family in FAMILIES[1:]:
        marker = {m.title(results): found.marker[m] for m in found.models(family, results)}
        members = [
            style.handle(title, color=family.colour, marker=shape, **common)
            for title, shape in marker.items()
        ]
        if members:
            entries.append((family.title, members))
    return entries
