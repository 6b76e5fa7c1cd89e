"""Elements hit by the entries of vectorised DEIM, and their cost (figure 3 of the preprint)."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from pdrom.core.paths import MESH, SAMPLING, SNAPSHOTS
from pdrom.core.store import open_hdf5
from pdrom.model.mesh.types import load_mesh
from pdrom.report.figures.deim_entries import Options
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.camera import Camera, window_of
from pdrom.report.figures.kit.elements import NEUTRAL, ElementMap, element_map
from pdrom.report.figures.kit.mesh_render import draw_surface, set_window
from pdrom.report.figures.kit.read import SamplingView, read_samplings
from pdrom.report.figures.kit.results import NothingToDraw, Results, asked

SEVERAL = "#333333"
ROW_HEIGHT = 1.85  # inches


def draw(results: Results, options: Options) -> Figure:
    """A row per experiment: the elements hit, entries per element, and numbers computed.

    Single-entry methods are compared with the other methods of the specification, which sample
    whole elements or rows; the first of them is drawn on the mesh, at the largest r.

    Raises
    ------
    StorageError
        A file of the results is missing, damaged or does not fit the mesh.
    """
    methods = results.methods(options)
    scalar = [m for m in methods if results.holdings.methods[m].rows == "scalar"]
    if not scalar:
        raise NothingToDraw("no method that samples single entries (deim, qdeim)")
    drawn = []
    for scene, group in results.experiments(options):
        samplings = {m: read_samplings(results.path(SAMPLING, scene, group, m)) for m in methods}
        if samplings[scalar[0]]:
            drawn.append((scene, group, samplings))
    if not drawn:
        raise NothingToDraw(f"samples of {asked(options)}")
    figure = Figure(figsize=(style.WIDTH, ROW_HEIGHT * len(drawn) + 0.55), layout="constrained")
    axes = figure.subplots(len(drawn), 3, squeeze=False, width_ratios=[1.25, 1.0, 1.1])
    for row, (scene, group, samplings) in zip(axes, drawn, strict=True):
        elements = _elements(results, scene, group)
        per_element = 3 * (elements.rows if elements else 1)
        chosen = _at(samplings[scalar[0]], options.ranks)
        camera = Camera(options.azimuth, options.elevation)
        _draw_hits(row[0], elements, chosen, camera)
        row[0].set_title(f"{results.experiment_title(scene, group)}\nr = {chosen.r} entries")
        _draw_counts(row[1], chosen, per_element)
        _draw_evaluations(row[2], samplings, per_element)
    _legend(figure, results, methods)
    return figure


class _Elements:
    """Elements of a group with the number of rows of each."""

    def __init__(self, mapping: ElementMap, rows: int) -> None:
        self.mapping = mapping
        self.rows = rows


def _elements(results: Results, scene: str, group: str) -> _Elements:
    path = results.path(SNAPSHOTS, scene, group)
    with open_hdf5(path) as file:
        count, rows = int(file.attrs["elements"]), int(file.attrs["rows_per_element"])
    mesh = load_mesh(results.path(MESH, scene))
    return _Elements(element_map(group, mesh, count, str(path)), rows)


def _at(samplings: list[SamplingView], ranks: tuple[int | str, ...]) -> SamplingView:
    """Selection for the first of ``ranks`` that exists, otherwise for the largest size."""
    for rank in ranks:
        for view in samplings:
            if view.r == rank:
                return view
    return samplings[-1]


def axes_hit(entries: np.ndarray, per_element: int) -> dict[int, str]:
    """Element -> "x", "y", "z", or "several" when its entries belong to more than one axis."""
    hit: dict[int, str] = {}
    for entry in entries:
        element, axis = int(entry) // per_element, "xyz"[int(entry) % 3]
        hit[element] = axis if hit.get(element, axis) == axis else "several"
    return hit


def _draw_hits(ax: Axes, elements: _Elements, chosen: SamplingView, camera: Camera) -> None:
    mapping, points = elements.mapping, elements.mapping.mesh.points
    draw_surface(ax, points, mapping.surface, camera, NEUTRAL, wire=0.18)
    hit = axes_hit(chosen.entries, 3 * elements.rows)
    centres = camera.project(mapping.centres(points))
    for axis, colour in (*style.AXES.items(), ("several", SEVERAL)):
        where = centres[[e for e, a in hit.items() if a == axis]]
        if len(where):
            ax.scatter(*where.T, s=15, color=colour, edgecolors="white", linewidths=0.4, zorder=5)
    set_window(ax, window_of(camera, [points], 0.04))


def _draw_counts(ax: Axes, chosen: SamplingView, per_element: int) -> None:
    counts = np.bincount(np.unique(chosen.entries // per_element, return_counts=True)[1])
    values = np.zeros(per_element, dtype=int)
    values[: len(counts) - 1] = counts[1 : per_element + 1]
    bars = ax.bar(np.arange(1, per_element + 1), values, color=style.ORANGE, width=0.7)
    ax.bar_label(bars, labels=[str(v) if v else "" for v in values], fontsize=7, padding=1)
    ax.set_xlim(0.3, per_element + 0.7)
    ax.set_ylim(0, 1.18 * values.max())
    ax.set_xticks(np.arange(1, per_element + 1))
    ax.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=4))
    ax.set_xlabel(f"entries used, of {per_element} per element")
    ax.set_ylabel("elements")


def _draw_evaluations(ax: Axes, samplings: dict[str, list[SamplingView]], per_element: int) -> None:
    styles = style.method_styles(samplings)
    largest = 1
    for method, views in samplings.items():
        if views:
            r = np.array([view.r for view in views])
            computed = per_element * np.array([len(view.elements) for view in views])
            colour, marker = styles[method]
            ax.plot(r, computed, color=colour, marker=marker, markevery=max(1, len(r) // 6))
            largest = max(largest, int(r[-1]))
    ax.plot([0, largest], [0, largest], color=style.GREY, linewidth=0.9, linestyle="--")
    ax.set_xlim(0, None)
    ax.set_ylim(0, None)
    ax.set_xlabel("basis size r")
    ax.set_ylabel("numbers computed")
    style.grid(ax)


def _legend(figure: Figure, results: Results, methods: list[str]) -> None:
    dots = {"linestyle": "none", "marker": "o", "markersize": 4.5}
    named = {**{f"{a} entry": c for a, c in style.AXES.items()}, "several axes": SEVERAL}
    handles = [Line2D([], [], color=c, label=label, **dots) for label, c in named.items()]
    for method, (colour, marker) in style.method_styles(methods).items():
        title = results.method_title(method)
        handles.append(Line2D([], [], color=colour, marker=marker, label=title))
    handles.append(
        Line2D([], [], color=style.GREY, linestyle="--", label="numbers that DEIM uses (r)")
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
