"""Snapshots of a group's projections and the first POD modes, drawn on the mesh (figure 1)."""

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize, SymLogNorm
from matplotlib.figure import Figure, SubFigure

from pdrom.core.paths import BASIS, FULL_ORDER, MESH, SNAPSHOTS
from pdrom.model.mesh.types import load_mesh
from pdrom.reduction.snapshots import SnapshotSet, load_snapshots
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.camera import Camera, Window, window_of
from pdrom.report.figures.kit.elements import ElementMap, element_map, magnitude
from pdrom.report.figures.kit.mesh_render import set_window
from pdrom.report.figures.kit.panels import fit_aspect
from pdrom.report.figures.kit.read import BasisView, positions_at, read_basis
from pdrom.report.figures.kit.results import NothingToDraw, Results, asked
from pdrom.report.figures.snapshots_and_modes import Options

# light to dark, so that zero is the paper's white
MAGNITUDE = LinearSegmentedColormap.from_list(
    "pdrom_magnitude", mpl.colormaps["magma_r"](np.linspace(0.02, 0.92, 256))
)


def draw(results: Results, options: Options) -> Figure:
    """The snapshot matrix, snapshots on the deformed mesh, and modes on the rest mesh.

    A snapshot is coloured by how far each projection has moved from the first one, a mode by the
    norm of its entries on each element. The first experiment and method that exist are drawn.

    Raises
    ------
    StorageError
        A file of the results is missing, damaged or does not fit the mesh.
    """
    found = results.holdings.first(options)
    if found is None:
        raise NothingToDraw(asked(options))
    scene, group, method = found
    path = results.path(BASIS, scene, group, method)
    basis, snapshots = read_basis(path), load_snapshots(results.path(SNAPSHOTS, scene, group))
    mesh = load_mesh(results.path(MESH, scene))
    elements = element_map(group, mesh, snapshots.elements, str(path))
    figure = Figure(figsize=(style.WIDTH, 5.6), layout="constrained")
    top, middle, bottom = figure.subfigures(3, 1, height_ratios=[1.0, 1.35, 1.35])
    title = results.experiment_title(scene, group)
    unit = results.holdings.groups[group].unit
    _draw_matrix(top, snapshots, unit, title)
    frames, positions = positions_at(results.path(FULL_ORDER, scene), options.frames)
    camera = Camera(options.azimuth, options.elevation)
    _draw_snapshots(middle, elements, snapshots, frames, positions, camera, unit)
    _draw_modes(bottom, elements, basis, options.count, camera)
    return figure


def _draw_matrix(figure: SubFigure, snapshots: SnapshotSet, unit: str, title: str) -> None:
    matrix = snapshots.train.reshape(len(snapshots.train), -1)
    ax = figure.subplots()
    limit = max(float(np.abs(matrix).max()), np.finfo(float).tiny)
    norm = SymLogNorm(linthresh=1e-2 * limit, vmin=-limit, vmax=limit)
    order = np.arange(matrix.shape[1]).reshape(-1, 3).T.ravel()  # all x, then all y, then all z
    image = ax.imshow(
        matrix[:, order], aspect="auto", cmap="RdBu_r", norm=norm, interpolation="nearest"
    )
    third = matrix.shape[1] / 3
    ax.set_xticks([third * (i + 0.5) for i in range(3)], ["x rows", "y rows", "z rows"])
    for i in (1, 2):
        ax.axvline(third * i - 0.5, color="black", linewidth=0.6)
    ax.tick_params(axis="x", length=0)
    ax.set_ylabel("snapshot (frame)")
    ticks = np.unique(np.linspace(0, len(matrix) - 1, 4).round().astype(int))
    ax.set_yticks(ticks, [str(snapshots.frames["train"][i]) for i in ticks])
    size = f"{matrix.shape[1]} × {matrix.shape[0]}"
    ax.set_title(f"{title}: training snapshots, transposed ({size} matrix)")
    bar = figure.colorbar(image, ax=ax, pad=0.01, aspect=12)
    bar.set_label(f"entry of p ({unit})" if unit else "entry of p")
    bar.set_ticks([-limit, 0.0, limit], labels=[f"{-limit:.2g}", "0", f"{limit:.2g}"])


def _draw_snapshots(
    figure: SubFigure,
    elements: ElementMap,
    snapshots: SnapshotSet,
    frames: list[int],
    positions: np.ndarray,
    camera: Camera,
    unit: str,
) -> None:
    rows = snapshots.rows_per_element
    taken = snapshots.frames["train"]
    nearest = [int(np.argmin(np.abs(taken - (frame - 1)))) for frame in frames]
    moved = [magnitude((snapshots.train[i] - snapshots.train[0]).ravel(), rows) for i in nearest]
    norm = Normalize(0.0, max(float(max(m.max() for m in moved)), np.finfo(float).tiny))
    windows = [window_of(camera, [q], 0.04) for q in positions]
    axes = figure.subplots(1, len(frames), squeeze=False)[0]
    for ax, index, q, values, window in zip(
        axes, nearest, positions, moved, _same_size(windows), strict=True
    ):
        elements.draw(ax, q, values, camera, MAGNITUDE, norm)
        set_window(ax, window)
        ax.set_title(f"snapshot of frame {taken[index]}")
    _colourbar(figure, axes, norm, f"change of p ({unit})" if unit else "change of p")


def _draw_modes(
    figure: SubFigure, elements: ElementMap, basis: BasisView, count: int, camera: Camera
) -> None:
    count = min(count, basis.rank)
    if count == 0:
        figure.text(0.5, 0.5, "no mode: every snapshot is round-off", ha="center", color="#666666")
        return
    norm = Normalize(0.0, 1.0)
    window = fit_aspect(window_of(camera, [elements.mesh.points], 0.05))
    axes = figure.subplots(1, count, squeeze=False)[0]
    first = max(float(basis.singular_values[0]), np.finfo(float).tiny)
    for k, ax in enumerate(axes):
        values = magnitude(basis.V[:, k], basis.rows_per_element)
        elements.draw(ax, elements.mesh.points, values / values.max(), camera, MAGNITUDE, norm)
        set_window(ax, window)
        ax.set_title(f"mode {k + 1}")
        ax.set_xlabel(f"σ/σ₁ = {basis.singular_values[k] / first:.1g}", fontsize=7.5)
    _colourbar(figure, axes, norm, "|mode| / largest")


def _colourbar(figure: SubFigure, axes: np.ndarray, norm: Normalize, label: str) -> None:
    mappable = ScalarMappable(norm, MAGNITUDE)
    bar = figure.colorbar(mappable, ax=list(axes), pad=0.01, aspect=14, fraction=0.04)
    bar.set_label(label)
    bar.outline.set_linewidth(0.4)


def _same_size(windows: list[Window]) -> list[Window]:
    size = (max(w.width for w in windows), max(w.height for w in windows))
    return [w.resized(*size) for w in windows]
