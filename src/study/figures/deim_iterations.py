"""The iterations of DEIM, drawn on the mesh."""

import numpy as np

from pdrom.model.mesh.types import load_mesh
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.camera import Camera, window_of
from pdrom.view.mesh_render import set_window
from pdrom.view.multiples import panels, rows_of
from pdrom.view.panels import fit_aspect
from pdrom.view.read import read_basis, read_samplings
from study.artifact.paths import BASIS, MESH, SAMPLING
from study.artifact.reads import Chosen
from study.figures.kit.declaration import figure
from study.figures.kit.elements import ElementMap, element_map, magnitudes
from study.figures.kit.options import Columns, Count, Experiments, Methods, View
from study.figures.kit.residual import Iteration, iterations
from study.figures.kit.results import NothingToDraw, Results, asked

EARLIER = {
    "markerfacecolor": "#FFFFFF", "markeredgecolor": style.BLACK, "markeredgewidth": 0.8,
    "markersize": 3.0,
}  # fmt: skip
NEWEST = {
    "markerfacecolor": "none", "markeredgecolor": style.SKY, "markeredgewidth": 1.6,
    "markersize": 8.5,
}  # fmt: skip


class Options(Experiments, Methods, Count, Columns, View):
    """Choices."""


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
    reads=(Chosen(MESH, first=True), Chosen(BASIS, first=True), Chosen(SAMPLING, first=True)),
    options=Options,
)
def deim_iterations(results: Results, options: Options) -> Figure:
    """Draw per step the residual of the current mode on the mesh and the elements picked so far.

    The first experiment and the first method that exist are drawn.
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
    elements = element_map(group, mesh, basis.elements, source=str(path))
    title = f"{results.experiment_title(scene, group)}, {results.method_title(method)}"
    return _draw_steps(steps, elements, options.camera, options.columns, title)


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
