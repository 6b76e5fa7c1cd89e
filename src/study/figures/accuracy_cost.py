"""Figures of error against time per frame: reduced models, full-order model, coarser meshes."""

import numpy as np
import pandas as pd

from pdrom.model.held_out import FIRST, PLAYBACK
from pdrom.reduction.settings import COARSER, pareto
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact import words
from study.artifact.reads import TableOf
from study.experiments.alternatives.experiment import REDUCTIONS
from study.experiments.kit.base import FOM
from study.figures.kit.declaration import METHODS, Drawn, NothingToDraw, figure, held
from study.figures.kit.labels import Curve, label_curves
from study.figures.kit.multiples import label_outer, rows_of, small_multiples, time_axis

ERROR, TIME = "relative_error_within_horizon", "ms_per_frame"
LOW, HIGH = 3e-3, 20.0  # limits of the error axis; errors outside are drawn on the limits
MESH_ERROR = {"color": style.GREY, "linestyle": "-.", "linewidth": 1.0, "zorder": 0}
SAMPLED = "ecsw"
# Curve -> label; the first two are curves of the full-order model.
CURVES = {
    FOM: "fewer or more iterations",
    COARSER: "coarser mesh",
    SAMPLED: words.method(SAMPLED),
    "published": words.method("published"),
    "gappy": words.method("gappy"),
    "block-deim": words.method("block-deim"),
}
HEIGHT = 2.3  # height of the figure, inches


def curves(table: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Return curve -> rows of ``table`` with a finite error and a time, the fastest first.

    Curves of coarser meshes and of sampled elements have the Pareto-optimal rows, others all rows.
    """
    table = table[(table[TIME] > 0.0) & np.isfinite(table[ERROR])]
    found = {}
    for name in CURVES:
        best = name in (COARSER, SAMPLED)
        rows = table[table.method.str.startswith(name) if best else table.method == name]
        rows = rows[(rows.position_basis == "pod") == (name == SAMPLED)]
        if len(rows):
            found[name] = best_points(rows, ERROR) if best else rows.sort_values(TIME)
    return found


@figure(
    title="Error against time per frame", reads={"table": TableOf("accuracy_cost")},
    scenes="bar_release spring_oop strain_oop bend_curved torus_release disc_strain ball_shell",
    timed=True,
)  # fmt: skip
def accuracy_cost(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """In this scene the method with three elements per mode is faster than the full-order model
    with fewer iterations at the same error. At larger errors, reduced positions and coarser meshes
    are faster still. Each mark is a setting. It shows the time per frame and the position error on
    the training trajectory up to the predictability horizon, relative to the converged step.
    Settings are basis sizes $r$ (interpolated projections), numbers of iterations (black:
    full-order model), and the best combinations of modes and tolerance (reduced positions) or of
    mesh, iterations and acceleration (coarser mesh). Dash-dotted line: discretisation error of the
    mesh, if known. Errors outside the axis are drawn on its limits.
    """
    scene = drawn.scenes_of(held(table.dropna(subset=[ERROR, TIME])))[0]
    table = table[table.scene == scene]
    found, labelled = curves(table), list[Curve]()
    figure = style.new_figure(HEIGHT)
    ax = figure.subplots()
    for name, rows in found.items():
        colour, marker = METHODS[name]
        points = np.stack([rows[TIME], rows[ERROR].clip(LOW, HIGH)], axis=1)
        ax.plot(*points.T, color=colour, marker=marker, markersize=4.5, linewidth=1.3)
        labelled.append((CURVES[name], colour, points))
    for error in table.mesh_error.dropna().unique():
        ax.axhline(error, **MESH_ERROR)
    style.log_axis(ax, LOW, HIGH)
    time_axis(ax, np.concatenate([rows[TIME] for rows in found.values()]))
    ax.set(title=words.scene(scene), xlabel="time per frame (ms)", ylabel="position error")
    label_curves(ax, labelled, (0.9 * style.WIDTH, HEIGHT - 0.6))
    return figure


LEAST, MOST = 1e-4, 1.0  # limits of the error axis; errors outside are drawn on the limits
BESIDE = 4  # largest number of panels in a row
BEST = {"full-order model": style.BLACK, "full-order, coarser meshes": style.ORANGE}
DOT = (0.55, 0.55, 0.55)
# Legend label -> (condition on the number of training trajectories of a reduction, colour).
TRAINED = {
    "reduced, one trajectory": ("training_motions == 1", "#7FCFB4"),
    "reduced, several trajectories": ("training_motions > 1", style.GREEN),
}
BARE = "without vertex positions"


@figure(
    title="Error against time for each mesh", reads={"table": TableOf("alternatives")},
    timed=True,
)  # fmt: skip
def alternatives(table: pd.DataFrame) -> Figure:
    r"""On most meshes, a full-order setting on the same or a coarser mesh is as accurate as the
    reduced models and faster. Position error over all frames of the first test trajectory, relative
    to the converged step on the same mesh, against the time per frame, in units of the time of ten
    plain local/global iterations. Black: best full-order settings (grey dots: all others). Orange:
    best settings on coarser meshes, with interpolated displacements. Green: reduced positions
    (ECSW) trained on one or several trajectories (dotted: without the time of vertex positions).
    Dashed: replaying the training trajectory. Dash-dotted: discretisation error of the mesh, by
    Richardson's rule (if the observed order is 0.5 to 3). $\times 100$: weights times 100. *: some
    results were recorded earlier or on another machine. Errors outside the axis are on its limits.
    """
    table = table[table.motion == FIRST]
    cases = table.groupby(["scene", "factor", "stiffness"])
    cases = [(labels, case) for labels, case in cases if case.time_ratio.notna().any()]
    if not cases:
        raise NothingToDraw
    beside = -(-len(cases) // rows_of(len(cases), BESIDE))
    figure, axes = small_multiples(len(cases), beside, legend_rows=3, height=1.6)
    for (labels, case), ax in zip(cases, axes, strict=True):
        _draw_case(ax, labels, case)
    label_outer(axes, beside, "time / time of ten iterations", y="position error")
    drawn = BEST | {label: colour for label, (_, colour) in TRAINED.items()}
    lines = [style.handle(BARE, color=style.GREEN, linestyle=":")]
    lines.append(style.handle("replaying the training trajectory", color="#555555", linestyle="--"))
    lines.append(style.handle("discretisation error", **MESH_ERROR))
    looks = {label: (colour, "o") for label, colour in drawn.items()}
    style.legend(figure, [*style.handles(looks), *lines], 3)
    return figure


def _draw_case(ax: Axes, labels: tuple[str, float, float], case: pd.DataFrame) -> None:
    (scene, _, stiffness), vertices = labels, case.vertices.max()
    stiff = "" if stiffness == 1.0 else rf" $\times {stiffness:g}$"
    mark = "*" if case.recorded.notna().any() else ""
    ax.set_title(f"{words.scene(scene)}{stiff},\n{vertices:,.0f} vertices{mark}", fontsize=7.5)
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
    """Return the ``rows`` that are Pareto-optimal in ``time`` and ``error``, the fastest first."""
    best = pareto(rows[error].to_list(), rows[time].to_list())
    return rows[np.array(best, dtype=bool)].sort_values(time)
