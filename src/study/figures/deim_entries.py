"""Elements that the entries of vectorised DEIM hit, and the cost of that."""

import numpy as np

from pdrom.core.store import open_hdf5
from pdrom.model.mesh.types import load_mesh
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.camera import Camera, window_of
from pdrom.view.mesh_render import draw_surface, set_window
from pdrom.view.read import SamplingView, read_samplings
from study.artifact.paths import MESH, SAMPLING, SNAPSHOTS, File
from study.artifact.reads import EachOf, Settings
from study.figures.kit.declaration import figure
from study.figures.kit.elements import NEUTRAL, ElementMap, element_map
from study.figures.kit.options import Drawn, Experiments, Methods, NothingToDraw, Ranks, View

SEVERAL = "#333333"
ROW_HEIGHT = 1.85  # inches


class Options(Experiments, Methods, Ranks, View):
    """Options of the figure."""


@figure(
    number=3,
    title="Elements hit by the entries of vectorised DEIM",
    caption=(
        "Single entries, picked without regard to elements, scatter over the mesh. Left: the "
        "elements they belong to, by axis. Middle: how many of its entries each touched element "
        "contributes. Right: numbers that have to be computed for $r$ interpolation entries, "
        "because a projection yields all entries of its element at once."
    ),
    reads={
        "drawn": Settings(Drawn),
        "meshes": EachOf(MESH, "experiments"),
        "snapshots": EachOf(SNAPSHOTS, "experiments"),
        "samples": EachOf(SAMPLING, "runs"),
    },
    options=Options,
)
def deim_entries(
    options: Options, drawn: Drawn, meshes: list[File], snapshots: list[File], samples: list[File]
) -> Figure:
    """Draw a row per experiment: the elements hit, entries per element, and numbers computed.

    Single-entry methods are compared with the other methods of the specification, which sample
    whole elements or rows; the first of them is drawn on the mesh, at the largest r.
    """
    methods = drawn.methods
    scalar = [m for m in methods if drawn.reductions[m].rows == "scalar"]
    if not scalar:
        raise NothingToDraw("no method that samples single entries (deim, qdeim)")
    sampled = []
    for each in drawn.experiments:
        samplings = {m: read_samplings(each.path(samples, method=m)) for m in methods}
        if samplings[scalar[0]]:
            sampled.append((each, samplings))
    if not sampled:
        raise NothingToDraw(f"samples of {options.words()}")
    figure = style.new_figure(ROW_HEIGHT * len(sampled) + 0.55)
    axes = figure.subplots(len(sampled), 3, squeeze=False, width_ratios=[1.25, 1.0, 1.1])
    for row, (each, samplings) in zip(axes, sampled, strict=True):
        elements, per_element = _elements(each.group, each.path(meshes), each.path(snapshots))
        chosen = _at(samplings[scalar[0]], options.ranks)
        _draw_hits(row[0], elements, axes_hit(chosen.entries, per_element), options.camera(each))
        row[0].set_title(f"{each.title}\nr = {chosen.r} entries")
        _draw_counts(row[1], chosen, per_element)
        _draw_evaluations(row[2], samplings, per_element)
    _legend(figure, drawn, methods)
    return figure


def _elements(group: str, mesh: str, snapshots: str) -> tuple[ElementMap, int]:
    """Elements of a group, and the number of entries of each; from its files."""
    with open_hdf5(snapshots) as file:
        count, rows = int(file.attrs["elements"]), int(file.attrs["rows_per_element"])
    return element_map(group, load_mesh(mesh), count, source=snapshots), 3 * rows


def _at(samplings: list[SamplingView], ranks: tuple[int | str, ...]) -> SamplingView:
    """Selection for the first of ``ranks`` that exists, otherwise for the largest size."""
    for rank in ranks:
        for view in samplings:
            if view.r == rank:
                return view
    return samplings[-1]


def axes_hit(entries: np.ndarray, per_element: int) -> dict[int, str]:
    """Element -> "x", "y", "z", or "several" when its entries belong to more than one axis.

    ``entries`` (n,) are vector indices, ``per_element`` are those of an element.
    """
    hit: dict[int, str] = {}
    for entry in entries:
        element, axis = int(entry) // per_element, "xyz"[int(entry) % 3]
        hit[element] = axis if hit.get(element, axis) == axis else "several"
    return hit


def _draw_hits(ax: Axes, elements: ElementMap, hit: dict[int, str], camera: Camera) -> None:
    points = elements.mesh.points
    draw_surface(ax, points, elements.mesh, camera=camera, colour=NEUTRAL, wire=0.18)
    centres = camera.project(elements.centres(points))
    for axis, colour in (*style.AXES.items(), ("several", SEVERAL)):
        where = centres[[e for e, a in hit.items() if a == axis]]
        if len(where):
            ax.scatter(*where.T, s=15, color=colour, edgecolors="white", linewidths=0.4, zorder=5)
    set_window(ax, window_of(camera, [points], 0.04))


def _draw_counts(ax: Axes, chosen: SamplingView, per_element: int) -> None:
    from matplotlib.ticker import MaxNLocator

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


def _legend(figure: Figure, drawn: Drawn, methods: list[str]) -> None:
    dots = {"linestyle": "none", "marker": "o", "markersize": 4.5}
    named = {**{f"{a} entry": c for a, c in style.AXES.items()}, "several axes": SEVERAL}
    handles = [style.handle(label, color=c, **dots) for label, c in named.items()]
    handles += drawn.handles(style.method_styles(methods))
    handles.append(style.handle("numbers that DEIM uses (r)", color=style.GREY, linestyle="--"))
    style.legend(figure, handles, 4)
