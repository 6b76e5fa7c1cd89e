"""The iterations of DEIM, drawn on the mesh."""

from dataclasses import dataclass

import numpy as np

from pdrom.core.errors import StorageError
from pdrom.model.mesh.types import load_mesh
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.camera import Camera, window_of
from pdrom.view.mesh_render import set_window
from pdrom.view.multiples import panels, rows_of
from pdrom.view.panels import fit_aspect
from pdrom.view.read import read_basis, read_samplings
from study.artifact.paths import BASIS, MESH, SAMPLING, File
from study.artifact.reads import EachOf, Settings
from study.figures.kit.declaration import figure
from study.figures.kit.elements import ElementMap, element_map, magnitudes
from study.figures.kit.options import (
    Columns,
    Count,
    Drawn,
    Experiments,
    Methods,
    NothingToDraw,
    View,
)

EARLIER = {
    "markerfacecolor": "#FFFFFF", "markeredgecolor": style.BLACK, "markeredgewidth": 0.8,
    "markersize": 3.0,
}  # fmt: skip
NEWEST = {
    "markerfacecolor": "none", "markeredgecolor": style.SKY, "markeredgewidth": 1.6,
    "markersize": 8.5,
}  # fmt: skip


@dataclass(frozen=True)
class Iteration:
    """Step k of a greedy selection.

    magnitude : (e,) on each element the residual of mode k in the measure that the selection
        takes the largest of: its largest entry (``rows`` "scalar"), the largest norm of one of its
        rows over x, y, z ("joint"), or the norm of all its entries ("element")
    earlier, newest : elements picked before, and in this step
    entry : vector index of the (first) entry picked in this step
    """

    k: int
    magnitude: np.ndarray
    earlier: np.ndarray
    newest: int
    entry: int


class Options(Experiments, Methods, Count, Columns, View):
    """Options of the figure."""


@figure(
    number=2,
    title="The first iterations of DEIM",
    caption=(
        "In step $k$ the residual of mode $k$ is taken against the modes before it, interpolated "
        "at the entries picked so far, and the entry where it is largest in absolute value is "
        "picked next. An element has the colour of its largest entry, so that the ringed one, "
        "which holds the picked entry, is the darkest; white dots are elements picked before. Each "
        "step asks for one number, whose whole element has to be projected for it."
    ),
    reads={
        "drawn": Settings(Drawn),
        "meshes": EachOf(MESH, "first_run"),
        "bases": EachOf(BASIS, "first_run"),
        "samples": EachOf(SAMPLING, "first_run"),
    },
    options=Options,
)
def deim_iterations(
    options: Options, drawn: Drawn, meshes: list[File], bases: list[File], samples: list[File]
) -> Figure:
    """Draw per step the residual of the current mode on the mesh and the elements picked so far.

    The first experiment and the first method that exist are drawn.
    """
    if not samples or next(iter(drawn.reductions.values())).rows == "all":
        raise NothingToDraw(f"samples of {options.words()}")
    experiment, (method, reduction) = drawn.experiments[0], next(iter(drawn.reductions.items()))
    path, rows = samples[0].path, reduction.rows
    basis, samplings = read_basis(bases[0].path), read_samplings(path)
    if not samplings:
        raise NothingToDraw(f"nothing was sampled for {experiment.title}")
    steps = iterations(basis.V, samplings[-1].entries, basis.rows_per_element, rows, options.count)
    mesh = load_mesh(meshes[0].path)
    elements = element_map(experiment.group, mesh, basis.elements, source=str(path))
    title = f"{experiment.title}, {drawn.title(method)}"
    return _draw_steps(steps, elements, options.camera(experiment), options.columns, title)


def _draw_steps(
    steps: list[Iteration], elements: ElementMap, camera: Camera, columns: int, title: str
) -> Figure:
    columns = min(columns, len(steps))
    window = fit_aspect(window_of(camera, [elements.mesh.points], 0.06))
    height = style.WIDTH / columns * min(window.height / window.width, 1.0) * 0.9 + 0.45
    figure = style.new_figure(rows_of(len(steps), columns) * height + 0.35)
    figure.suptitle(title, fontsize=9)
    axes, colours = panels(figure, len(steps), columns), magnitudes()
    for ax, step in zip(axes, steps, strict=True):
        relative = step.magnitude / max(float(step.magnitude.max()), np.finfo(float).tiny)
        elements.draw(ax, elements.mesh.points, relative, camera, colours)
        _mark(ax, step, elements, camera)
        set_window(ax, window)
        ax.set_title(f"k = {step.k}: element {step.newest}, {'xyz'[step.entry % 3]} entry")
        ax.set_xlabel(f"largest residual {step.magnitude.max():.2g}", fontsize=7.5)
    bar = figure.colorbar(colours, ax=axes, aspect=25, pad=0.01, fraction=0.03)
    bar.set_label("residual of the element / largest")
    dots = {"picked before": EARLIER, "picked in this step": NEWEST}
    marks = {"linestyle": "none", "marker": "o"}
    style.legend(figure, [style.handle(label, **marks, **d) for label, d in dots.items()], 2)
    return figure


def _mark(ax: Axes, step: Iteration, elements: ElementMap, camera: Camera) -> None:
    centres = camera.project(elements.centres(elements.mesh.points))
    if len(step.earlier):
        ax.plot(*centres[step.earlier].T, "o", zorder=5, **EARLIER)
    ax.plot(*centres[step.newest], "o", zorder=6, **NEWEST)


def iterations(
    V: np.ndarray, entries: np.ndarray, rows_per_element: int, rows: str, count: int
) -> list[Iteration]:
    """First ``count`` steps of a greedy selection.

    The residual of step k is v_k - V_{k-1} c with c from the equations sampled so far
    (Chaturantabut and Sorensen 2010, algorithm 1); the next sample is where it is largest.

    Parameters
    ----------
    V : (3 e p, rank) modes, p ``rows_per_element``
    entries : vector indices as selected: one a step for ``rows`` "scalar" and "joint" (there the x
        entry of a row stands for the row), 3 p a step for "element"

    Raises
    ------
    StorageError
        An entry lies outside the basis, or there are not enough for one step.
    """
    per_step = 3 * rows_per_element if rows == "element" else 1
    if len(entries) < per_step or entries.min() < 0 or entries.max() >= len(V):
        raise StorageError(f"{len(entries)} sampled entries do not fit a basis of {len(V)} rows")
    residual_of = _joint_residual if rows == "joint" else _shared_residual
    steps = []
    for k in range(min(count, len(entries) // per_step, V.shape[1])):
        residual = residual_of(V, entries[: k * per_step], k)
        picked = entries[: (k + 1) * per_step : per_step] // (3 * rows_per_element)
        steps.append(
            Iteration(
                k=k + 1,
                magnitude=_measured(residual, rows_per_element, rows),
                earlier=picked[:-1],
                newest=int(picked[-1]),
                entry=int(entries[k * per_step]),
            )
        )
    return steps


def _measured(residual: np.ndarray, rows_per_element: int, rows: str) -> np.ndarray:
    """Size of a residual (3 e p,) by elements (e,)."""
    length = {"scalar": 1, "joint": 3, "element": 3 * rows_per_element}[rows]
    norms = np.linalg.norm(residual.reshape(-1, length), axis=1)
    return norms.reshape(-1, 3 * rows_per_element // length).max(axis=1)


def _shared_residual(V: np.ndarray, entries: np.ndarray, k: int) -> np.ndarray:
    """Residual of mode k with coefficients shared by all axes; least squares when oversampled."""
    if k == 0:
        return V[:, 0]
    coefficients = np.linalg.lstsq(V[entries, :k], V[entries, k], rcond=None)[0]
    return V[:, k] - V[:, :k] @ coefficients


def _joint_residual(V: np.ndarray, entries: np.ndarray, k: int) -> np.ndarray:
    """Residual of mode k with one set of coefficients per axis, from the same rows."""
    split = V.reshape(-1, 3, V.shape[1])
    residual = np.empty(split.shape[:2])
    for axis in range(3):
        residual[:, axis] = _shared_residual(split[:, axis], entries // 3, k)
    return residual.ravel()
