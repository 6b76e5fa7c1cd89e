"""The mesh data type, its HDF5 storage, areas and volumes of vertices, boundary edges."""

import os
from dataclasses import dataclass, field
from typing import Annotated

import h5py
import numpy as np
from pydantic import Field

from pdrom.core.packed import brief
from pdrom.core.store import open_hdf5, write_hdf5

# Allowed lengths, m: their sums and squares neither overflow nor lose all digits.
MIN_LENGTH, MAX_LENGTH = 1e-6, 1e6
Length = Annotated[float, Field(ge=-MAX_LENGTH, le=MAX_LENGTH)]
PositiveLength = Annotated[float, Field(ge=MIN_LENGTH, le=MAX_LENGTH)]


_ARRAYS = ("points", "triangles", "tetrahedra")


@dataclass(frozen=True)
class Mesh:
    """A triangle or tetrahedron mesh at rest.

    points : (N, 3) float64, metres
    triangles : (T, 3) int32; in a volume mesh the boundary faces, oriented outwards
    tetrahedra : (E, 4) int32; empty (0, 4) in a surface mesh
    """

    points: np.ndarray
    triangles: np.ndarray
    tetrahedra: np.ndarray = field(default_factory=lambda: np.empty((0, 4), dtype=np.int32))

    __repr__ = brief

    @property
    def vertices(self) -> int:
        """Number N of vertices."""
        return len(self.points)

    @property
    def extent(self) -> float:
        """Longest side of the bounding box at rest, metres."""
        return float(np.ptp(self.points, axis=0).max())

    def edges(self) -> np.ndarray:
        """Return each edge (a, b), a < b, once: (n, 2) int32, in lexicographic order."""
        cells = self.tetrahedra if len(self.tetrahedra) else self.triangles
        corners = cells.shape[1]
        pairs = [cells[:, [i, j]] for i in range(corners) for j in range(i + 1, corners)]
        return np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0).astype(np.int32)


def save_mesh(mesh: Mesh, path: str | os.PathLike[str], attributes: dict | None = None) -> None:
    """Write ``mesh`` (points and cells) and ``attributes`` to the HDF5 file ``path``."""
    with write_hdf5(path) as file:
        store_mesh(mesh, file)
        file.attrs.update(attributes or {})


def store_mesh(mesh: Mesh, group: h5py.Group) -> None:
    """Write the arrays of a ``mesh`` to an HDF5 ``group``."""
    for name in _ARRAYS:
        group[name] = getattr(mesh, name)
    group["points"].attrs["unit"] = "m"


def load_mesh(path: str | os.PathLike[str]) -> Mesh:
    """Return the mesh in the file ``path`` from `save_mesh`; StorageError if it is damaged."""
    with open_hdf5(path) as file:
        return stored_mesh(file)


def stored_mesh(group: h5py.Group) -> Mesh:
    """Return the mesh that `store_mesh` has written to the HDF5 ``group``."""
    return Mesh(*(group[name][...] for name in _ARRAYS))


def barycentric_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return areas (N,) m^2 of vertices at ``points`` (N, 3) m: a third of their triangles."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.bincount(triangles.ravel(), np.repeat(area / 3.0, 3), minlength=len(points))


def vertex_measures(mesh: Mesh) -> np.ndarray:
    """Return the volume, m^3, or in a surface mesh the area, m^2, of each vertex at rest, (N,).

    It is a quarter of the volume of the tetrahedra, or a third of the triangles, at the vertex.
    """
    if len(mesh.tetrahedra) == 0:
        return barycentric_areas(mesh.points, mesh.triangles)
    corner = mesh.points[mesh.tetrahedra]
    volume = np.abs(np.linalg.det(corner[:, 1:] - corner[:, :1])) / 6.0
    return np.bincount(mesh.tetrahedra.ravel(), np.repeat(volume / 4.0, 4), minlength=mesh.vertices)


def boundary_edges(triangles: np.ndarray) -> np.ndarray:
    """Return edges (n, 2) that belong to a single triangle (T, 3), in lexicographic order."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    # one integer per edge, since sorting rows would be twenty times slower
    size = int(edges.max()) + 1
    unique, count = np.unique(edges[:, 0] * np.int64(size) + edges[:, 1], return_counts=True)
    return np.column_stack(np.divmod(unique[count == 1], size)).astype(edges.dtype)
