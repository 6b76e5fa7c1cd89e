"""The mesh that everything later works on."""

import os
from dataclasses import dataclass, field

import h5py
import numpy as np

from pdrom.core.brief import brief
from pdrom.core.store import open_hdf5, write_hdf5

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
