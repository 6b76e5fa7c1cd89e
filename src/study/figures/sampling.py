"""Figures drawn on the mesh: snapshots and modes, iterations of DEIM, sampled elements."""

from dataclasses import dataclass

import numpy as np

from pdrom.core.errors import StorageError
from pdrom.core.store import open_hdf5
from pdrom.model.mesh.types import load_mesh
from pdrom.reduction.basis import Basis, load_basis
from pdrom.reduction.sampling.reduction import Sampling
from pdrom.reduction.snapshots import load_snapshots
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.camera import Camera, Window, window_of
from pdrom.view.mesh_render import draw_surface, set_window
from pdrom.view.panels import fit_aspect
from study.artifact.paths import BASIS, MESH, SAMPLING, SNAPSHOTS, TRAIN, File
from study.artifact.reads import EachOf
from study.figures.kit import elements as shapes
from study.figures.kit.declaration import MESHES, Drawn, NothingToDraw, camera_of, figure
from study.figures.kit.multiples import panels, rows_of
from study.figures.kit.read import positions_at, read_samplings

EARLIER = {"mfc": "#FFFFFF", "mec": style.BLACK, "markeredgewidth": 0.8, "markersize": 3.0}
NEWEST = {"mfc": "none", "mec": style.SKY, "markeredgewidth": 1.6, "markersize": 8.5}
SEVERAL = "several"  # in place of x, y or z if entries of several axes of an element are sampled
AXES = {"x": style.VERMILLION, "y": style.GREEN, "z": style.BLUE, SEVERAL: "#333333"}
SCENES = f"strain_oop strain_twist_twin spring_stretch bar_release {MESHES}"
STEPS, COLUMNS = 6, 3  # selection steps of figure `deim_iterations`, and panels in a row
ENTRIES = 20  # basis size in figure `deim_entries`; the largest size where there is no such basis
INSTANTS, MODES = (0.15, 0.5, 0.85), 4  # instants as fractions of a run; number of modes
ROW_HEIGHT = 1.6  # height of a row of panels, inches


@dataclass(frozen=True)
class Iteration:
    """Step k of DEIM on a basis.

    magnitude : (e,) largest absolute entry of mode k's residual on each element
    earlier, newest : indices of the elements with the entries chosen in earlier steps, in this step
    entry : index, in the vector of the mode, of the entry chosen in this step
    """

    k: int
    magnitude: np.ndarray
    earlier: list[int]
    newest: int
    entry: int


@figure(
    number=2, title="The first iterations of DEIM",
    reads={
        "meshes": EachOf(MESH, "drawn.first_run"), "bases": EachOf(BASIS, "drawn.first_run"),
        "samples": EachOf(SAMPLING, "drawn.first_run"),
    }, scenes=SCENES, methods="deim",
)  # fmt: skip
def deim_iterations(
    drawn: Drawn, meshes: list[File], bases: list[File], samples: list[File]
) -> Figure:
    """Each step of DEIM selects one entry, although the projection of a complete element has to be
    computed for this entry. Step $k$ interpolates mode $k$ by the modes before it at the entries
    selected so far, and selects the entry with the largest absolute residual. The colour of an
    element shows the largest residual among its entries. The ring marks the element of the entry
    selected in this step, white dots mark those of earlier steps.
    """
    experiment, method, path = drawn.experiments[0], drawn.methods[0], samples[0].path
    basis, samplings = load_basis(bases[0].path), read_samplings(path)
    if not samplings or drawn.reductions[method].rows != "scalar":
        raise NothingToDraw
    entries, camera = samplings[max(samplings)].entries, camera_of(experiment, 45.0)
    steps = iterations(basis.V, entries, basis.rows_per_element, STEPS)
    mesh = load_mesh(meshes[0].path)
    elements = shapes.element_map(experiment.group, mesh, basis.elements, source=str(path))
    columns = min(COLUMNS, len(steps))
    window = fit_aspect(window_of(camera, [mesh.points], 0.06))
    height = style.WIDTH / columns * min(window.height / window.width, 1.0) * 0.9 + 0.45
    figure = style.new_figure(rows_of(len(steps), columns) * height + 0.35)
    figure.suptitle(f"{experiment.title}, {drawn.title(method)}", fontsize=9)
    axes, colours = panels(figure, len(steps), columns), shapes.magnitudes()
    for ax, step in zip(axes, steps, strict=True):
        largest = float(step.magnitude.max())
        relative = step.magnitude / max(largest, np.finfo(float).tiny)
        elements.draw(ax, mesh.points, relative, camera, colours)
        centres = camera.project(elements.centres(mesh.points))
        ax.plot(*centres[step.earlier].T, "o", zorder=5, **EARLIER)
        ax.plot(*centres[step.newest], "o", zorder=6, **NEWEST)
        ax.set_title(f"k = {step.k}: element {step.newest}, {'xyz'[step.entry % 3]} entry")
        ax.set_xlabel(f"largest residual {largest:.2g}", fontsize=7.5)
        set_window(ax, window)
    bar = figure.colorbar(colours, ax=axes, aspect=25, pad=0.01, fraction=0.03)
    bar.set_label("residual of the element / largest")
    dots = {"selected before": EARLIER, "selected in this step": NEWEST}
    marks = {"linestyle": "none", "marker": "o"}
    style.legend(figure, [style.handle(label, **marks, **d) for label, d in dots.items()], 2)
    return figure


def iterations(
    V: np.ndarray, entries: np.ndarray, rows_per_element: int, count: int
) -> list[Iteration]:
    """Recompute the first ``count`` steps of DEIM from the selected entries.

    The residual of step k is v_k - V_{k-1} c: mode v_k minus its interpolation by the earlier modes
    V_{k-1}, with coefficients c from the equations at the entries so far (Chaturantabut and
    Sorensen 2010, algorithm 1). The next entry is taken where the residual is largest. Raises
    StorageError if there is no entry, or if one lies outside the basis.

    V : (3 e p, rank) modes of e elements with p = ``rows_per_element``
    entries : row indices of V in the order of selection, one per step
    """
    if not len(entries) or entries.min() < 0 or entries.max() >= len(V):
        raise StorageError(f"{len(entries)} sampled entries do not fit a basis of {len(V)} rows")
    steps = []
    for k in range(min(count, len(entries), V.shape[1])):
        earlier = entries[:k]
        coefficients = np.linalg.lstsq(V[earlier, :k], V[earlier, k], rcond=None)[0]
        residual = np.abs(V[:, k] - V[:, :k] @ coefficients)
        magnitude = residual.reshape(-1, 3 * rows_per_element).max(axis=1)
        *before, newest = (entries[: k + 1] // (3 * rows_per_element)).tolist()
        steps.append(Iteration(k + 1, magnitude, before, newest, int(entries[k])))
    return steps


@figure(
    number=3, title="Elements that entry-wise DEIM samples",
    reads={
        "meshes": EachOf(MESH, "drawn.experiments"),
        "snapshots": EachOf(SNAPSHOTS, "drawn.experiments"),
        "samples": EachOf(SAMPLING, "drawn.runs"),
    },
    scenes="spring_twist strain_twist_twin bar_release disc_strain torus_release starfish_twist",
    methods="deim qdeim block-deim",
)  # fmt: skip
def deim_entries(drawn: Drawn, **files: list[File]) -> Figure:
    """The $r$ entries that entry-wise DEIM selects lie in nearly $r$ elements. More entries are
    computed than used, since a projection yields all entries of its element. Left: sampled
    elements, coloured by the coordinate of the selected entry. Middle: number of sampled elements,
    by how many of their entries are used. Right: entries that are computed for a basis of size $r$.
    """
    scalar = [m for m, reduction in drawn.reductions.items() if reduction.rows == "scalar"]
    read = [
        (each, {m: read_samplings(each.find(files["samples"], method=m)) for m in drawn.methods})
        for each in drawn.experiments
    ]
    sampled = [(each, found) for each, found in read if scalar and found[scalar[0]]]
    if not sampled:
        raise NothingToDraw
    figure = style.new_figure(ROW_HEIGHT * len(sampled) + 0.55)
    axes = figure.subplots(len(sampled), 3, squeeze=False, width_ratios=[1.25, 1.0, 1.1])
    for row, (each, samplings) in zip(axes, sampled, strict=True):
        source = each.find(files["snapshots"])
        with open_hdf5(source) as file:
            count, rows = int(file.attrs["elements"]), int(file.attrs["rows_per_element"])
        mesh = load_mesh(each.find(files["meshes"]))
        elements = shapes.element_map(each.group, mesh, count, source=source)
        sizes = samplings[scalar[0]]
        r = ENTRIES if ENTRIES in sizes else max(sizes)
        _draw_hits(row[0], elements, sizes[r].entries, 3 * rows, camera_of(each))
        row[0].set_title(f"{each.title}\nr = {r} entries")
        _draw_counts(row[1], sizes[r].entries // (3 * rows), 3 * rows)
        _draw_evaluations(row[2], samplings, 3 * rows, drawn.looks)
    dots = {"linestyle": "none", "marker": "o", "markersize": 4.5}
    handles = [
        style.handle("several axes" if axis == SEVERAL else f"{axis} entry", color=colour, **dots)
        for axis, colour in AXES.items()
    ]
    handles += drawn.handles(drawn.looks)
    handles.append(style.handle("used by entry-wise DEIM (r)", color=style.GREY, linestyle="--"))
    style.legend(figure, handles, 4)
    return figure


def _draw_hits(
    ax: Axes, elements: shapes.ElementMap, entries: np.ndarray, per_element: int, camera: Camera
) -> None:
    """Draw a dot on each sampled element, in the colour of its sampled axis or of `SEVERAL`."""
    hit: dict[int, str] = {}
    for entry in entries:
        element, axis = int(entry) // per_element, "xyz"[int(entry) % 3]
        hit[element] = axis if hit.get(element, axis) == axis else SEVERAL
    points = elements.mesh.points
    draw_surface(ax, points, elements.mesh, camera=camera, colour=shapes.NEUTRAL, wire=0.18)
    centres = camera.project(elements.centres(points))
    for axis, colour in AXES.items():
        where = centres[np.array([e for e, a in hit.items() if a == axis], int)]
        ax.scatter(*where.T, s=15, color=colour, edgecolors="white", linewidths=0.4, zorder=5)
    set_window(ax, window_of(camera, [points], 0.04))


def _draw_counts(ax: Axes, hit: np.ndarray, per_element: int) -> None:
    from matplotlib.ticker import MaxNLocator

    counts = np.bincount(np.unique(hit, return_counts=True)[1])
    values = np.zeros(per_element, dtype=int)
    values[: len(counts) - 1] = counts[1 : per_element + 1]
    bars = ax.bar(np.arange(1, per_element + 1), values, color=style.ORANGE, width=0.7)
    ax.bar_label(bars, labels=[str(v) if v else "" for v in values], fontsize=7.5, padding=1)
    ax.set(xlim=(0.3, per_element + 0.7), ylim=(0, 1.18 * values.max()))
    ax.set_xticks(np.arange(1, per_element + 1))
    ax.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=4))
    ax.set(xlabel=f"entries used, of {per_element} per element", ylabel="elements")


def _draw_evaluations(
    ax: Axes, samplings: dict[str, dict[int, Sampling]], per_element: int,
    looks: dict[str, tuple[str, str]],
) -> None:  # fmt: skip
    largest = 1
    for method, sizes in samplings.items():
        if sizes:
            computed = [per_element * len(sampled.elements) for sampled in sizes.values()]
            colour, marker = looks[method]
            every = max(1, len(sizes) // 6)
            ax.plot(list(sizes), computed, color=colour, marker=marker, markevery=every)
            largest = max(largest, *sizes)
    ax.plot([0, largest], [0, largest], color=style.GREY, linewidth=0.9, linestyle="--")
    ax.set(xlim=(0, None), ylim=(0, None), xlabel="basis size r", ylabel="entries computed")
    ax.grid(True)


# (left edge, width, height) of the four drawn matrices, inches; their upper edges are aligned.
BLOCKS = ((0.75, 1.45, 1.9), (2.65, 1.45, 1.9), (4.55, 0.8, 0.8), (5.65, 0.8, 0.8))
SIGNS = ((2.36, "="), (4.33, "×"), (5.5, "×"))
ABOVE, TITLE, FOOTER = 0.36, 0.34, 0.44  # heights, inches: two text lines, title, colour scale
LEFT, TALLEST = 0.75, 1.45  # left edge and largest height of pictures of the mesh, inches


@figure(
    number=1, title="Snapshots of the projections and their modes",
    reads={
        "meshes": EachOf(MESH, "drawn.first_run"), "full_order": EachOf(TRAIN, "drawn.first_run"),
        "sets": EachOf(SNAPSHOTS, "drawn.first_run"), "bases": EachOf(BASIS, "drawn.first_run"),
    }, scenes=SCENES, methods="deim block-deim pod",
)  # fmt: skip
def snapshots_and_modes(drawn: Drawn, **files: list[File]) -> Figure:
    """Snapshots of the projections, less their mean, are a product of modes, singular values and
    coefficients. Each column of the left matrix is a snapshot. Red entries are positive, blue
    entries negative; large singular values are dark. Below: some snapshots on the deformed mesh,
    and the first modes on the mesh at rest. The colour of an element is the value of one of its
    entries (coordinate and row are in the title), relative to the largest absolute value.
    """
    experiment, path = drawn.experiments[0], files["bases"][0].path
    basis, snapshots = load_basis(path), load_snapshots(files["sets"][0].path)
    mesh = load_mesh(files["meshes"][0].path)
    elements = shapes.element_map(experiment.group, mesh, snapshots.elements, source=str(path))
    centred = snapshots.train.reshape(len(snapshots.train), -1).T - basis.mean[:, None]
    frames, positions = positions_at(files["full_order"][0].path, INSTANTS)
    camera = camera_of(experiment, 28.0)
    taken = [int(np.argmin(np.abs(snapshots.frames["train"] - (f - 1)))) for f in frames]
    moving = [window_of(camera, [q], 0.04) for q in positions]
    size = (max(w.width for w in moving), max(w.height for w in moving))
    moving = [window.resized(*size) for window in moving]
    resting = fit_aspect(window_of(camera, [mesh.points], 0.05))
    count = min(MODES, basis.rank)
    heights = [_height(moving[0], len(frames)), _height(resting, count) if count else 0.3]
    total = ABOVE + BLOCKS[0][2] + sum(heights) + 2 * TITLE + FOOTER
    figure = style.new_figure(total, None)
    _draw_product(figure, basis, centred, experiment.title)
    bottom = total - ABOVE - BLOCKS[0][2] - TITLE - heights[0]
    axes = _row(figure, len(frames), bottom, heights[0], "snapshots\nless mean")
    for ax, k, q, window in zip(axes, taken, positions, moving, strict=True):
        slot = _draw_column(ax, elements, q, centred[:, k], camera)
        set_window(ax, window)
        ax.set_title(f"frame {int(snapshots.frames['train'][k])}: {slot}", pad=2)
    axes = _row(figure, count, bottom - TITLE - heights[1], heights[1], "modes")
    for k, ax in enumerate(axes):
        slot = _draw_column(ax, elements, mesh.points, basis.V[:, k], camera)
        set_window(ax, resting)
        ratio = basis.singular_values[k] / basis.singular_values[0]
        ax.set_title(f"{k + 1}: {slot}, σ/σ₁ = {ratio:.2g}", pad=2, fontsize=7.5)
    ax = figure.add_axes((0.35, 0.33 / total, 0.45, 0.08 / total))
    bar = figure.colorbar(shapes.signed(), cax=ax, orientation="horizontal")
    bar.set_label("the named entry of each element / largest", labelpad=1)
    bar.set_ticks([-1.0, 0.0, 1.0])
    bar.outline.set_linewidth(0.4)
    return figure


def _height(window: Window, count: int) -> float:
    return min(TALLEST, (style.WIDTH - LEFT) / count * window.height / window.width)


def _draw_product(figure: Figure, basis: Basis, centred: np.ndarray, title: str) -> None:
    """Draw snapshots = modes x singular values x coefficients as matrices, rows sorted by axis."""
    from matplotlib.colors import LogNorm

    rank, tiny = basis.rank, np.finfo(float).tiny
    values = np.maximum(basis.singular_values[:rank], tiny)
    coefficients = np.linalg.lstsq(basis.V, centred, rcond=None)[0] / values[:, None]
    order = np.arange(len(centred)).reshape(-1, 3).T.ravel()
    whole, axes = figure.get_figheight(), []
    for left, width, height in BLOCKS:
        place = (left / style.WIDTH, (whole - ABOVE - height) / whole, width / style.WIDTH)
        ax = figure.add_axes((*place, height / whole), xticks=[], yticks=[])
        ax.tick_params(length=0)
        ax.spines[:].set_visible(True)
        axes.append(ax)
    _draw_matrix(axes[0], centred[order], f"{title}: snapshots\nless mean")
    _draw_matrix(axes[1], basis.V[order], "modes")
    _draw_matrix(axes[3], coefficients, "coefficients")
    largest = values.max(initial=tiny)
    shades = LogNorm(min(values.min(initial=largest), 0.1 * largest), largest)
    at = np.arange(rank)
    axes[2].scatter(at, at, c=values, cmap="Greys", norm=shades, s=5.0, linewidths=0.0)
    axes[2].set(xlim=(-1, max(rank, 1)), ylim=(max(rank, 1), -1))
    axes[2].set_title(f"singular values\n{rank} × {rank}", fontsize=7.5, pad=3)
    third = len(centred) / 3
    for ax in axes[:2]:
        ax.set_yticks([third * (i + 0.5) for i in range(3)], ["x", "y", "z"])
        for i in (1, 2):
            ax.axhline(third * i - 0.5, color="black", linewidth=0.5)
    axes[0].set_ylabel("entries, by axis", labelpad=5)
    for x, sign in SIGNS:
        y = (whole - ABOVE - 0.5 * BLOCKS[2][2]) / whole
        figure.text(x / style.WIDTH, y, sign, ha="center", va="center", fontsize=14)


def _draw_matrix(ax: Axes, matrix: np.ndarray, title: str) -> None:
    from matplotlib.colors import SymLogNorm

    rows, columns = matrix.shape
    ax.set_title(f"{title}\n{rows} × {columns}".replace("mean\n", "mean, "), fontsize=7.5, pad=3)
    if matrix.size:
        limit = max(float(np.abs(matrix).max()), np.finfo(float).tiny)
        norm = SymLogNorm(linthresh=1e-2 * limit, vmin=-limit, vmax=limit)
        ax.imshow(matrix, aspect="auto", cmap=shapes.SIGNED, norm=norm, interpolation="nearest")


def _row(figure: Figure, count: int, bottom: float, height: float, label: str) -> list[Axes]:
    """Return ``count`` axes in a row, ``bottom`` inches above the lower edge of the ``figure``."""
    whole, step = figure.get_figheight(), (style.WIDTH - LEFT) / max(count, 1) / style.WIDTH
    middle = (bottom + 0.5 * height) / whole
    figure.text(0.008, middle, label, va="center", fontsize=7.5)
    if count == 0:
        note = "no mode: all snapshots are rounding errors"
        figure.text(0.5, middle, note, ha="center", va="center", color="#666666")
    left = LEFT / style.WIDTH
    return [
        figure.add_axes((left + i * step, bottom / whole, step, height / whole))
        for i in range(count)
    ]


def _draw_column(
    ax: Axes, elements: shapes.ElementMap, points: np.ndarray, column: np.ndarray, camera: Camera
) -> str:
    """Colour each element by its `signed_entry` of ``column``, scaled to 1; name the entry."""
    values, words = shapes.signed_entry(column, len(column) // (3 * len(elements.cells)))
    largest = max(float(np.abs(values).max()), np.finfo(float).tiny)
    elements.draw(ax, points, values / largest, camera, shapes.signed())
    return words
