"""Figure of the snapshots of a group's projections and of their first POD modes on the mesh."""

import numpy as np

from pdrom.model.mesh.types import load_mesh
from pdrom.reduction.basis import Basis, load_basis
from pdrom.reduction.snapshots import load_snapshots
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from pdrom.view.camera import Camera, Window, window_of
from pdrom.view.mesh_render import set_window
from pdrom.view.panels import fit_aspect
from pdrom.view.read import positions_at
from study.artifact.paths import BASIS, MESH, SNAPSHOTS, TRAIN, File
from study.artifact.reads import EachOf
from study.figures.kit.declaration import figure
from study.figures.kit.elements import SIGNED, ElementMap, element_map, signed, signed_entry
from study.figures.kit.options import Count, Drawn, Instants, NothingToDraw, View

# (left end, width, height) in inches of the four matrices, aligned at their upper ends
BLOCKS = ((0.75, 1.6, 1.9), (2.8, 1.6, 1.9), (4.8, 0.85, 0.85), (6.0, 0.85, 0.85))
SIGNS = ((2.575, "="), (4.6, "×"), (5.825, "×"))
ABOVE, TITLE, FOOTER = 0.36, 0.34, 0.44  # inches for two lines, for a title, for the scale
LEFT, TALLEST = 0.75, 1.45  # left end and largest height of pictures, inches


class Snapshots(View):
    """Options: view, instants of the snapshots, and the number of modes."""

    frames: Instants = (0.1, 0.5, 0.9)
    count: Count = 6


@figure(
    number=1,
    title="Snapshots of the projections and their modes",
    caption="""The snapshots of one constraint group, a column each, less their mean, are the
    product of modes, singular values (a diagonal, dark where large) and coefficients; red entries
    are positive, blue ones negative. Below, columns of the first matrix on the moving mesh and the
    first modes on the mesh at rest: an element has the colour of one of its entries, whose axis and
    row are named, relative to the largest.""",
    reads={
        "meshes": EachOf(MESH, "first_run"),
        "full_order": EachOf(TRAIN, "first_run"),
        "sets": EachOf(SNAPSHOTS, "first_run"),
        "bases": EachOf(BASIS, "first_run"),
    },
)
def snapshots_and_modes(
    options: Snapshots,
    drawn: Drawn,
    meshes: list[File],
    full_order: list[File],
    sets: list[File],
    bases: list[File],
) -> Figure:
    """Draw snapshots less their mean = modes x singular values x coefficients, as matrices.

    Below are columns of the snapshot matrix on the moving mesh, and modes on the mesh at rest. Each
    element has the colour of one of its entries, the entry that is largest on some element. Only
    the first experiment and method that exist are drawn.
    """
    if not bases:
        raise NothingToDraw(options.words())
    experiment, path = drawn.experiments[0], bases[0].path
    basis, snapshots = load_basis(path), load_snapshots(sets[0].path)
    mesh = load_mesh(meshes[0].path)
    elements = element_map(experiment.group, mesh, snapshots.elements, source=str(path))
    centred = snapshots.train.reshape(len(snapshots.train), -1).T - basis.mean[:, None]
    frames, positions = positions_at(full_order[0].path, options.frames)
    camera = options.camera(experiment)
    taken = [int(np.argmin(np.abs(snapshots.frames["train"] - (f - 1)))) for f in frames]
    moving = [window_of(camera, [q], 0.04) for q in positions]
    size = (max(w.width for w in moving), max(w.height for w in moving))
    moving = [window.resized(*size) for window in moving]
    resting = fit_aspect(window_of(camera, [mesh.points], 0.05))
    count = min(options.count, basis.rank)
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
    _draw_scale(figure)
    return figure


def _height(window: Window, count: int) -> float:
    return min(TALLEST, (style.WIDTH - LEFT) / count * window.height / window.width)


def _draw_product(figure: Figure, basis: Basis, centred: np.ndarray, title: str) -> None:
    """Draw the four matrices; rows of snapshots and modes are sorted by axis, first x."""
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
    axes[0].set_ylabel("rows of p, by axis", labelpad=5)
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
        ax.imshow(matrix, aspect="auto", cmap=SIGNED, norm=norm, interpolation="nearest")


def _row(figure: Figure, count: int, bottom: float, height: float, label: str) -> list[Axes]:
    """Axes for a row of pictures, ``bottom`` inches from below, with ``label`` on the left."""
    whole, step = figure.get_figheight(), (style.WIDTH - LEFT) / max(count, 1) / style.WIDTH
    middle = (bottom + 0.5 * height) / whole
    figure.text(0.008, middle, label, va="center", fontsize=7.5)
    if count == 0:
        words = "no mode: every snapshot is round-off"
        figure.text(0.5, middle, words, ha="center", va="center", color="#666666")
    left = LEFT / style.WIDTH
    return [
        figure.add_axes((left + i * step, bottom / whole, step, height / whole))
        for i in range(count)
    ]


def _draw_column(
    ax: Axes, elements: ElementMap, points: np.ndarray, column: np.ndarray, camera: Camera
) -> str:
    """Draw one signed entry of each element, over the largest; return the name of the entry."""
    values, words = signed_entry(column, len(column) // (3 * len(elements.cells)))
    largest = max(float(np.abs(values).max()), np.finfo(float).tiny)
    elements.draw(ax, points, values / largest, camera, signed())
    return words


def _draw_scale(figure: Figure) -> None:
    whole = figure.get_figheight()
    ax = figure.add_axes((0.35, 0.33 / whole, 0.45, 0.08 / whole))
    bar = figure.colorbar(signed(), cax=ax, orientation="horizontal")
    bar.set_label("the named entry of each element / largest", labelpad=1)
    bar.set_ticks([-1.0, 0.0, 1.0])
    bar.outline.set_linewidth(0.4)
