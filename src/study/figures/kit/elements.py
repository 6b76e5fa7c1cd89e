"""Draw the elements of a constraint group on the mesh, coloured by values."""

from dataclasses import dataclass

import numpy as np

from pdrom.core.errors import StorageError
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.effects import EFFECTS
from pdrom.model.mesh.types import Mesh
from pdrom.view.artists import Axes, Normalize, ScalarMappable
from pdrom.view.camera import Camera
from pdrom.view.mesh_render import RASTER_ABOVE, draw_surface

NEUTRAL = "#E4E1DA"
SIGNED = "RdBu_r"


def magnitudes(norm: Normalize | None = None) -> ScalarMappable:
    """Return a colour map from near white to dark, for the range of ``norm`` (default 0 to 1)."""
    import matplotlib as mpl
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    shades = mpl.colormaps["magma_r"](np.linspace(0.02, 0.92, 256))
    colours = LinearSegmentedColormap.from_list("pdrom_magnitude", shades)
    return ScalarMappable(norm or Normalize(0.0, 1.0), colours)


def signed() -> ScalarMappable:
    """Return a colour map from blue to red for values from -1 to 1."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(-1.0, 1.0), SIGNED)


@dataclass(frozen=True)
class ElementMap:
    """Elements of one constraint group on one mesh, to be coloured by values.

    kind : part of the mesh that is an element: vertex, edge, triangle or tetrahedron
    cells : (e, m) vertex indices of each element
    """

    kind: str
    cells: np.ndarray
    mesh: Mesh

    def centres(self, points: np.ndarray) -> np.ndarray:
        """Return the centres (e, 3) m of all elements for vertices at ``points`` (N, 3) m."""
        return points[self.cells].mean(axis=1)

    def face_values(self, values: np.ndarray) -> np.ndarray:
        """Transfer ``values`` of elements (e,) to the triangles of the surface, (T,).

        If elements are triangles or tetrahedra, a surface triangle gets the value of its element.
        If elements are vertices or edges, it gets the mean over its three vertices (NaN if none of
        them has a value); without a given value, a vertex gets the mean over its edges.
        """
        triangles = self.mesh.triangles
        if self.kind == "triangle":
            return values
        if self.kind == "tetrahedron":
            corners = self.mesh.tetrahedra[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]]
            faces = np.sort(corners.reshape(-1, 3), axis=1).tolist()
            behind = {tuple(face): place // 4 for place, face in enumerate(faces)}
            return values[[behind[tuple(sorted(triangle))] for triangle in triangles.tolist()]]
        ends, n = self.cells if self.kind == "edge" else self.cells[:, :1], self.mesh.vertices
        total = np.bincount(ends.ravel(), np.repeat(values, ends.shape[1]), minlength=n)
        with np.errstate(invalid="ignore"):  # 0 / 0 = NaN marks vertices without a value
            corners = (total / np.bincount(ends.ravel(), minlength=n))[triangles]
            known = np.isfinite(corners)
            return np.where(known, corners, 0.0).sum(axis=1) / known.sum(axis=1)

    def draw(
        self, ax: Axes, points: np.ndarray, values: np.ndarray, camera: Camera,
        colours: ScalarMappable,
    ) -> None:  # fmt: skip
        """Draw the mesh at ``points`` (N, 3) m with its elements coloured by ``values`` (e,)."""
        from matplotlib.collections import LineCollection

        if self.kind == "edge" and not len(self.mesh.tetrahedra):
            look = {"colour": "#FFFFFF", "wire": 0.0, "contrast": 0.15}
            draw_surface(ax, points, self.mesh, camera=camera, **look)
            lines = points[self.cells]
            order = np.argsort(camera.depth(lines.mean(axis=1)), kind="stable")  # far edges first
            flat, shades = camera.project(lines.reshape(-1, 3)), colours.to_rgba(values)
            look = {"linewidths": 1.2, "capstyle": "round", "rasterized": len(lines) > RASTER_ABOVE}
            flat = flat.reshape(-1, 2, 2)[order]
            ax.add_collection(LineCollection(flat, colors=shades[order], zorder=2.0, **look))
            return
        carried = self.face_values(values)
        rgb = colours.to_rgba(np.nan_to_num(carried))[:, :3]
        rgb[~np.isfinite(carried)] = (0.92, 0.91, 0.89)
        draw_surface(ax, points, self.mesh, camera=camera, colour=rgb, wire=0.12, contrast=0.35)


def element_map(group: str, mesh: Mesh, elements: int, source: str) -> ElementMap:
    """Return the elements of the constraint ``group`` on ``mesh``, in the order of snapshot rows.

    Raises StorageError if the effect ``group`` is no constraint group, or if ``elements``, the
    number of elements in the file ``source``, is not the number of elements on ``mesh``.
    """
    effect = EFFECTS.load(group)
    if not issubclass(effect, ConstraintGroup):
        raise StorageError(f"{source}: '{group}' has no elements that could be drawn")
    cells = effect.element_vertices(mesh)
    if len(cells) != elements:
        raise StorageError(f"{source}: {elements} elements of '{group}', the mesh has {len(cells)}")
    return ElementMap(effect.cells, cells, mesh)


def signed_entry(vector: np.ndarray, rows_per_element: int) -> tuple[np.ndarray, str]:
    """Return one of the 3 p entries of each element (e,), and the name of this entry.

    ``vector`` has 3 p entries for each of e elements, p = ``rows_per_element``. All elements use
    the index at which ``vector`` has its largest absolute value. Names: "x", "x, row 2".
    """
    entries = vector.reshape(-1, 3 * rows_per_element)
    slot = int(np.argmax(np.abs(vector))) % (3 * rows_per_element)
    row = f", row {slot // 3 + 1}" if rows_per_element > 1 else ""
    return entries[:, slot], f"{'xyz'[slot % 3]}{row}"
