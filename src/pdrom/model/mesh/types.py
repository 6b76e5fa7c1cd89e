"""The mesh that everything later works on: its arrays, lengths, measures and boundary."""

import os
from dataclasses import dataclass, field
from typing import Annotated

import h5py
import numpy as np
from pydantic import Field

from pdrom.core.packed import brief
from pdrom.core.store import open_hdf5, write_hdf5

# Sums and squares of lengths within these limits neither overflow nor lose every digit.
MIN_LENGTH, MAX_LENGTH = 1e-6, 1e6
Length = Annotated[float, Field(ge=-MAX_LENGTH, le=MAX_LENGTH)]
PositiveLength = Annotated[float, Field(ge=MIN_LENGTH, le=MAX_LENGTH)]


_ARRAYS = ("points", "triangles", "tetrahedra")


@dataclass(frozen=True)
class Mesh:
    """A triangle or tetrahedron mesh at rest.

    points : (N, 3) float64, metres
    triangles : (T, 3) int32; of a volume mesh its boundary, oriented outwards
    tetrahedra : (E, 4) int32; empty for a surface
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
        """Unique edges (n, 2) int32 with a < b, in lexicographic order."""
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
    """Write the arrays of a mesh into a group of a file."""
    for name in _ARRAYS:
        group[name] = getattr(mesh, name)
    group["points"].attrs["unit"] = "m"


def load_mesh(path: str | os.PathLike[str]) -> Mesh:
    """Read the file ``path`` by `save_mesh`; StorageError if it is damaged."""
    with open_hdf5(path) as file:
        return stored_mesh(file)


def stored_mesh(group: h5py.Group) -> Mesh:
    """Mesh that `store_mesh` wrote into the HDF5 ``group``."""
    return Mesh(*(group[name][...] for name in _ARRAYS))


def barycentric_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """A third of the area of the adjacent ``triangles`` (T, 3) at ``points`` (N, 3) m, (N,) m^2."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.bincount(triangles.ravel(), np.repeat(area / 3.0, 3), minlength=len(points))


def vertex_measures(mesh: Mesh) -> np.ndarray:
    """Share of each vertex in the rest shape (N,): m^3 of a volume mesh, m^2 of a surface.

    A vertex has a quarter of the adjacent tetrahedra, a third of the adjacent triangles.
    """
    if len(mesh.tetrahedra) == 0:
        return barycentric_areas(mesh.points, mesh.triangles)
    corner = mesh.points[mesh.tetrahedra]
    volume = np.abs(np.linalg.det(corner[:, 1:] - corner[:, :1])) / 6.0
    return np.bincount(mesh.tetrahedra.ravel(), np.repeat(volume / 4.0, 4), minlength=mesh.vertices)


def boundary_edges(triangles: np.ndarray) -> np.ndarray:
    """Edges (n, 2) that belong to one of the ``triangles`` (T, 3) only, sorted."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    # one number an edge: rows are sorted twenty times slower
    size = int(edges.max()) + 1
    unique, count = np.unique(edges[:, 0] * np.int64(size) + edges[:, 1], return_counts=True)
    return np.column_stack(np.divmod(unique[count == 1], size)).astype(edges.dtype)
