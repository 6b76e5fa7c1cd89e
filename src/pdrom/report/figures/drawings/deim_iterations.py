"""The iterations of DEIM, drawn on the mesh (figure 2 of the preprint)."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pdrom.core.paths import BASIS, MESH, SAMPLING
from pdrom.model.mesh.types import load_mesh
from pdrom.report.figures.deim_iterations import Options
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.camera import Camera, window_of
from pdrom.report.figures.kit.elements import MAGNITUDE, ElementMap, element_map
from pdrom.report.figures.kit.mesh_render import set_window
from pdrom.report.figures.kit.panels import fit_aspect
from pdrom.report.figures.kit.read import read_basis, read_samplings
from pdrom.report.figures.kit.residual import Iteration, iterations
from pdrom.report.figures.kit.results import NothingToDraw, Results, asked

EARLIER = {
    "markerfacecolor": "#FFFFFF", "markeredgecolor": style.BLACK, "markeredgewidth": 0.8,
    "markersize": 3.0,
}  # fmt: skip
NEWEST = {
    "markerfacecolor": "none", "markeredgecolor": style.SKY, "markeredgewidth": 1.6,
    "markersize": 8.5,
}  # fmt: skip


def draw(results: Results, options: Options) -> Figure:
    """Per step: the residual of the current mode on the mesh and the elements picked so far.

    The first experiment and the first method that exist are drawn.

    Raises
    ------
    StorageError
        A file of the results is missing, damaged or does not fit the mesh.
    """
    found = results.holdings.first(options)
    if found is None or results.holdings.methods[found[2]].rows == "all":
        raise NothingToDraw(f"samples of {asked(options)}")
    scene, group, method = found
    path = results.path(SAMPLING, scene, group, method)
    basis, samplings = read_basis(results.path(BASIS, scene, group, method)), read_samplings(path)
    if not samplings:
        raise NothingToDraw(f"nothing was sampled for {results.experiment_title(scene, group)}")
    rows = results.holdings.methods[method].rows
    steps = iterations(basis.V, samplings[-1].entries, basis.rows_per_element, rows, options.count)
    mesh = load_mesh(results.path(MESH, scene))
    elements = element_map(group, mesh, basis.elements, str(path))
    title = f"{results.experiment_title(scene, group)}, {results.method_title(method)}"
    return _draw_steps(
        steps, elements, Camera(options.azimuth, options.elevation), options.columns, title
    )


def _draw_steps(
    steps: list[Iteration], elements: ElementMap, camera: Camera, columns: int, title: str
) -> Figure:
    columns = min(columns, len(steps))
    rows = -(-len(steps) // columns)
    window = fit_aspect(window_of(camera, [elements.mesh.points], 0.06))
    height = rows * (style.WIDTH / columns * min(window.height / window.width, 1.0) * 0.9 + 0.45)
    figure = Figure(figsize=(style.WIDTH, height + 0.35), layout="constrained")
    figure.suptitle(title, fontsize=9)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    norm = Normalize(0.0, 1.0)
    for ax, step in zip(axes, steps, strict=False):
        relative = step.magnitude / max(float(step.magnitude.max()), np.finfo(float).tiny)
        elements.draw(ax, elements.mesh.points, relative, camera, MAGNITUDE, norm)
        _mark(ax, step, elements, camera)
        set_window(ax, window)
        ax.set_title(f"k = {step.k}: element {step.newest}, {'xyz'[step.entry % 3]} entry")
        ax.set_xlabel(f"largest residual {step.magnitude.max():.2g}", fontsize=7.5)
    for ax in axes[len(steps) :]:
        ax.remove()
    bar = figure.colorbar(
        ScalarMappable(norm, MAGNITUDE), ax=list(axes[: len(steps)]), aspect=25, pad=0.01,
        fraction=0.03,
    )  # fmt: skip
    bar.set_label("residual of the element / largest")
    _legend(figure)
    return figure


def _mark(ax: Axes, step: Iteration, elements: ElementMap, camera: Camera) -> None:
    centres = camera.project(elements.centres(elements.mesh.points))
    if len(step.earlier):
        ax.plot(*centres[step.earlier].T, "o", zorder=5, **EARLIER)
    ax.plot(*centres[step.newest], "o", zorder=6, **NEWEST)


def _legend(figure: Figure) -> None:
    handles = [
        Line2D([], [], linestyle="none", marker="o", label="picked before", **EARLIER),
        Line2D([], [], linestyle="none", marker="o", label="picked in this step", **NEWEST),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
