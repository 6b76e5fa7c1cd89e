"""Error and time of reductions and of alternatives to projective dynamics."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pdrom.model.held_out import FIRST, PLAYBACK
from pdrom.reduction.settings import COARSER, pareto
from pdrom.view import style
from pdrom.view.artists import Axes, Figure, Line2D
from study.artifact.reads import TableOf
from study.experiments.alternatives.experiment import REDUCTIONS
from study.experiments.kit.base import ANDERSON, FOM
from study.figures.kit.declaration import Drawn, NothingToDraw, figure
from study.figures.kit.multiples import label_outer, rows_of, small_multiples, time_axis

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")
ERROR, TIME = "relative_error_within_horizon", "ms_per_frame"
LOW, HIGH = 1e-3, 1e2  # limits of the error axis; errors outside are arrows at the limits
ABOVE, BELOW, BLOWN_UP = 6, 7, "x"  # Matplotlib markers: error above axis, below it, blow-up
OWN = {"color": style.GREY, "linewidth": 1.2}
MESH_ERROR = {"color": style.GREY, "linestyle": "-.", "linewidth": 1.0, "zorder": 0}
LARGE, SMALL = 2.6, 1.6  # heights of the large and of the small panels, inches
LINE, GAP = 0.145, 0.06  # height of a legend line, gap between rows of legend blocks, inches
NEAR = 0.05  # markers closer in x than this fraction of the x axis share a label
COLUMNS = 4  # number of legend blocks in a row
# Families of reduced models and of full-order runs, each with its colour.
FAMILIES = {
    "full order, K iterations": style.BLACK,
    "full order, coarser meshes": style.ORANGE,
    "orthogonal projection": style.PURPLE,
    "single entries, joint rows": style.VERMILLION,
    "whole elements": style.BLUE,
    "subspace, weighted or full": style.GREEN,
    "subspace, interpolated": style.SKY,
}
ITERATIONS, COARSE, PROJECTION, ENTRIES, ELEMENTS, WEIGHTED, INTERPOLATED = FAMILIES
_BY_ROWS = {"all": PROJECTION, "scalar": ENTRIES, "joint": ENTRIES, "element": ELEMENTS}


def look_of(method: str, position_basis: str, drawn: Drawn) -> tuple[str | None, str]:
    """Family of a model (see `FAMILIES`; None if it is not drawn), and its legend entry."""
    if method == FOM:
        return ITERATIONS, "K iterations"
    if method.startswith(COARSER):
        return COARSE, "plain and accelerated"
    if position_basis == "full":
        known = drawn.reductions.get(method)
        return _BY_ROWS[known.rows] if known else None, drawn.title(method)
    if method == "full":
        return WEIGHTED, "all projections"
    return (WEIGHTED, "ecsw, by tolerance") if method.startswith("ecsw") else (INTERPOLATED, method)


@dataclass(frozen=True)
class TradeOffs:
    """Points (error, time) of reduced models in all scenes.

    The "own" full-order run of a scene has as many iterations as the scene's configuration sets.

    points : rows of table accuracy_cost, with ``family`` and ``member`` by `look_of`, and with the
        ``marker`` of the member; errors are against the converged run
    blown_up : the same of reduced runs that blew up before an error could be computed
    own : scene -> row of its own full-order run; mesh_error is NaN where it is not known
    """

    points: pd.DataFrame
    blown_up: pd.DataFrame
    own: pd.DataFrame


def trade_offs(drawn: Drawn, table: pd.DataFrame, runs: pd.DataFrame) -> TradeOffs:
    """Return points (error, time) of what ``drawn`` selects, in scenes that have some.

    Raises NothingToDraw if no reduced model has both an error and a time.
    """
    table = table.dropna(subset=[ERROR, TIME])
    own = (table.method == "full") & (table.position_basis == "full")
    points = _drawn(table[(table[TIME] > 0.0) & ~own & (table.method != ANDERSON)], drawn)
    points = points[points.scene.isin(drawn.scenes_of(points))]
    number = points.groupby("family").member.transform(lambda names: pd.factorize(names)[0])
    marker = number.map(lambda i: MARKERS[i % len(MARKERS)]).where(points.family != ITERATIONS, "X")
    lost = runs[(runs.blowup_frame >= 0) & runs[ERROR].isna() & (runs[TIME] > 0.0)]
    points = points.assign(number=number, marker=marker)
    return TradeOffs(points, _drawn(lost, drawn), table[own].set_index("scene"))


def _drawn(table: pd.DataFrame, drawn: Drawn) -> pd.DataFrame:
    """Rows of ``table`` that are drawn, with new columns: family and legend entry of the model."""
    names = zip(table.method, table.position_basis, strict=True)
    looks = pd.DataFrame(
        [look_of(*name, drawn) for name in names], table.index, ["family", "member"], dtype=object
    )
    return table.assign(**looks).dropna(subset="family")


def draw_panel(ax: Axes, found: TradeOffs, scene: str, size: float = 3.0) -> None:
    """Draw the models of ``scene``, the Pareto front of each family, and the full-order run.

    Errors outside the axis are arrows at its ends, runs that blew up crosses near the upper end.
    """
    ax.set_xscale("log")
    style.log_axis(ax, LOW, HIGH)
    rows, lost = (part[part.scene == scene] for part in (found.points, found.blown_up))
    for family, colour in FAMILIES.items():
        part = rows[rows.family == family]
        for (_, hollow), own in part.groupby(["number", part.position_basis == "skinning"]):
            fill = {"fillstyle": "none"} if hollow else {}
            _points(ax, own, size, colour, marker=own.marker.iloc[0], **fill)
        front = best_points(part, ERROR)
        heights = np.clip(front[ERROR].to_numpy(float), LOW, HIGH)
        steps = {"linewidth": 1.3, "drawstyle": "steps-post", "zorder": 1.5}
        ax.plot(front[TIME], heights, color=colour, **steps)
        ended = lost[lost.family == family][TIME]
        cross = {"markersize": 6.0, "markeredgewidth": 1.8}
        ax.plot(ended, np.full(len(ended), 0.6 * HIGH), BLOWN_UP, color=colour, **cross)
    run = found.own[found.own.index == scene]
    time_axis(ax, np.array([*rows[TIME], *lost[TIME], *run[TIME]], dtype=float))
    for time, error in zip(run[TIME], run.mesh_error, strict=True):
        ax.axvline(time, zorder=0, **OWN)
        ax.axhline(error, **MESH_ERROR)


def _points(ax: Axes, rows: pd.DataFrame, size: float, colour: str, **look: Any) -> None:
    error, time = rows[ERROR].to_numpy(float), rows[TIME].to_numpy(float)
    inside = (error >= LOW) & (error <= HIGH)
    common = {"linestyle": "none", "color": colour, "alpha": 0.75, "markeredgewidth": 0.9}
    ax.plot(time[inside], error[inside], markersize=size, **common, **look)
    for outside, rim, arrow in ((error < LOW, LOW, BELOW), (error > HIGH, HIGH, ABOVE)):
        at = np.full(outside.sum(), rim)
        ax.plot(time[outside], at, marker=arrow, markersize=size + 2.5, **common)


def label_iterations(ax: Axes, found: TradeOffs, scene: str) -> None:
    """Write "K = ..." beside full-order runs of ``scene``; neighbouring runs share a label."""
    rows = found.points[(found.points.scene == scene) & (found.points.method == FOM)]
    rows = rows.sort_values(TIME)
    low, high = np.log10(ax.get_xlim())
    groups: list[list[tuple[float, float, float]]] = []
    for marker in zip(rows[TIME], rows[ERROR], rows.iterations, strict=True):
        near = groups and np.log10(marker[0] / groups[-1][-1][0]) < NEAR * (high - low)
        groups[-1].append(marker) if near else groups.append([marker])
    for group in groups:
        numbers = ", ".join(f"{count:.0f}" for _, _, count in group)
        at = (group[0][0], min(height for _, height, _ in group))
        look = {"textcoords": "offset points", "fontsize": 6.5, "ha": "right", "va": "top"}
        ax.annotate(f"K = {numbers}", at, (-2.5, -3.5), **look)


def handles(found: TradeOffs) -> list[tuple[str, list[Line2D]]]:
    """Return blocks of the legend: full-order runs, then the models in ``found`` by `FAMILIES`."""
    common = {"linewidth": 1.0, "markersize": 4.0}
    first = style.handles({"K iterations": (style.BLACK, "X")}, **common)
    first.append(style.handle("time with the scene's K", **OWN))
    first.append(style.handle("error of the mesh itself", **MESH_ERROR))
    blocks = [("full order", first)]
    for family in [*FAMILIES][1:]:
        members = found.points[found.points.family == family].sort_values("number")
        looks = {row.member: (FAMILIES[family], row.marker) for row in members.itertuples()}
        blocks += [(family, style.handles(looks, **common))] if looks else []
    return blocks


@figure(
    title="What accuracy costs in time",
    reads={"table": TableOf("accuracy_cost"), "runs": TableOf("reduced_reruns")},
    # the first scene of the study is drawn large, then one for each other group
    scenes="bar_release spring_oop strain_oop bend_curved bar_twist torus_release disc_strain "
    "ball_shell starfish_twist",
    timed=True,
)
def accuracy_cost(drawn: Drawn, table: pd.DataFrame, runs: pd.DataFrame) -> Figure:
    """Position error within the horizon, against the converged run, and time per frame of every
    reduced model and of the full-order run with $K$ iterations, also on coarser meshes, whose
    displacement is interpolated to all vertices. The vertical line is the time of the scene's own
    number of iterations, the horizontal one the error of the mesh itself (Richardson's rule): a
    smaller error buys no accuracy. A colour is a family of models, a marker one of its members (one
    for all tolerances; hollow: in a subspace of skinning weights), a line the best trade-offs
    within the family: further down and further left is better. Arrows on the rim are errors outside
    the axis, crosses runs that blew up. Below, a scene for each other constraint group.
    """
    found = trade_offs(drawn, table, runs)
    first, *rest = drawn.scenes_of(found.points)
    groups = {scene: drawn.groups_of(scene) for scene in (first, *rest)}
    small = list({groups[scene]: scene for scene in reversed(rest)}.values())[::-1]
    blocks = handles(found)
    rows = [blocks[i : i + COLUMNS] for i in range(0, len(blocks), COLUMNS)]
    lines = [LINE * (1.3 + max(len(entries) for _, entries in row)) + GAP for row in rows]
    heights = [LARGE, *([SMALL] if small else []), sum(lines)]
    figure = style.new_figure(sum(heights))
    parts = figure.subfigures(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
    ax = parts[0].subplots()
    draw_panel(ax, found, first, size=4.2)
    label_iterations(ax, found, first)
    ax.set_title(f"{groups[first]}: {style.words(first)}")
    ax.set(xlabel="time per frame (ms)", ylabel="position error")
    if small:
        axes = parts[1].subplots(1, len(small), sharey=True, squeeze=False)[0]
        for ax, scene in zip(axes, small, strict=True):
            draw_panel(ax, found, scene, size=2.4)
            ax.set(title=f"{groups[scene]}:\n{style.words(scene)}", xlabel="time per frame (ms)")
        axes[0].set_ylabel("position error")
    top = 1.0
    for row, height in zip(rows, lines, strict=True):
        for place, (title, entries) in enumerate(row):
            parts[-1].legend(
                handles=entries, title=title, loc="upper left", alignment="left",
                bbox_to_anchor=(0.01 + place / COLUMNS, top), fontsize=7, title_fontsize=7.5,
                borderpad=0.0, borderaxespad=0.1, labelspacing=0.3, handlelength=1.8,
            )  # fmt: skip
        top -= height / sum(lines)
    return figure


LEAST, MOST = 1e-4, 1.0  # limits of the error axis; errors outside are drawn on the limits
BESIDE = 4  # largest number of panels in a row
BEST, DOT = {"full order, same mesh": style.BLACK, COARSE: FAMILIES[COARSE]}, (0.55, 0.55, 0.55)
# Legend label -> (condition on the number of training motions of a reduction, colour).
TRAINED = {
    "reduced, one training trajectory": ("training_motions == 1", style.GREEN),
    "reduced, several trajectories": ("training_motions > 1", style.BLUE),
}
BARE = "reduced, without the vertices"


@figure(
    title="Alternatives to projective dynamics", reads={"table": TableOf("alternatives")},
    timed=True,
)  # fmt: skip
def alternatives(table: pd.DataFrame) -> Figure:
    r"""Position error over all frames against the converged step of the same mesh, and time per
    frame with the positions of all vertices, on the first test trajectory. A time of 1 is that of
    plain projective dynamics with ten iterations. Black: the best settings of the full-order model,
    whose other settings are the grey dots; orange: on coarser meshes, whose displacement is
    interpolated to all vertices. Green and blue: the reduced model (ecsw), trained on one or on
    several trajectories; dotted: without the time of the vertices. Dashed: the training trajectory,
    replayed. Dash-dotted: the error of the mesh itself, by Richardson's rule on three meshes (drawn
    if the observed order is 0.5 to 3); a smaller error buys no accuracy. $\times 100$: stiffer
    weights; *: recorded by the extended study. Errors outside are drawn on the rim.
    """
    table = table[table.motion == FIRST]
    cases = table.groupby(["scene", "factor", "stiffness"])
    cases = [(labels, case) for labels, case in cases if case.time_ratio.notna().any()]
    if not cases:
        raise NothingToDraw
    beside = -(-len(cases) // rows_of(len(cases), BESIDE))
    figure, axes = small_multiples(len(cases), beside, legend_rows=3, height=1.9)
    for (labels, case), ax in zip(cases, axes, strict=True):
        _draw_case(ax, labels, case)
    label_outer(axes, beside, "time / plain frame", y="position error")
    drawn = BEST | {label: colour for label, (_, colour) in TRAINED.items()}
    lines = [style.handle(BARE, color=style.GREEN, linestyle=":")]
    lines.append(style.handle("training trajectory replayed", color="#555555", linestyle="--"))
    lines.append(style.handle("error of the mesh itself", **MESH_ERROR))
    looks = {label: (colour, "o") for label, colour in drawn.items()}
    style.legend(figure, [*style.handles(looks), *lines], 3)
    return figure


def _draw_case(ax: Axes, labels: tuple[str, float, float], case: pd.DataFrame) -> None:
    (scene, _, stiffness), vertices = labels, case.vertices.max()
    stiff = "" if stiffness == 1.0 else rf" $\times {stiffness:g}$"
    mark = "*" if case.recorded.notna().any() else ""
    ax.set_title(f"{style.words(scene)}{stiff}, {vertices:,.0f} vertices{mark}", fontsize=7.0)
    style.log_axis(ax, LEAST, MOST)
    time_axis(ax, case.time_ratio.to_numpy(float))
    rows = case.rename(columns={"error_implicit": "error"}).dropna(subset="error")
    for error in rows.error[rows.method == PLAYBACK]:
        ax.axhline(error, color="#555555", linestyle="--", linewidth=0.8)
    for error in rows.mesh_error.dropna():
        ax.axhline(error, **MESH_ERROR)
    rows = rows[rows.time_ratio.notna()]
    inside, coarse = rows.method.isin(REDUCTIONS), rows.method.str.startswith(COARSER)
    full = rows[~inside & ~coarse]
    errors = np.clip(full.error.to_numpy(float), LEAST, MOST)
    ax.plot(full.time_ratio, errors, ".", color=DOT, markersize=3.0)
    for best, colour in zip((full, rows[coarse]), BEST.values(), strict=True):
        _draw_best(ax, best, colour, "-")
    for trained, colour in TRAINED.values():
        own = rows[inside].query(trained)
        _draw_best(ax, own, colour, "-")
        _draw_best(ax, own.assign(time_ratio=own.time_ratio - own.vertices_ratio), colour, ":")


def _draw_best(ax: Axes, rows: pd.DataFrame, colour: str, line: str) -> None:
    points = best_points(rows, "error", "time_ratio")
    errors = np.clip(points.error.to_numpy(float), LEAST, MOST)
    look = {"color": colour, "marker": "o" if line == "-" else None, "markersize": 3.2}
    ax.plot(points.time_ratio, errors, line, linewidth=1.0, **look)


def best_points(rows: pd.DataFrame, error: str, time: str = TIME) -> pd.DataFrame:
    """Pareto-optimal ``rows`` with respect to columns ``time`` and ``error``, the fastest first."""
    best = pareto(rows[error].to_list(), rows[time].to_list())
    return rows[np.array(best, dtype=bool)].sort_values(time)
