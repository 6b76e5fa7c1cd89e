"""The basis of one group's projections."""

import os
from dataclasses import dataclass

import numpy as np

from pdrom.core.brief import brief
from pdrom.core.errors import RankError
from pdrom.core.store import open_hdf5, write_hdf5


@dataclass(frozen=True, eq=False)
class Basis:
    """Affine space mean + span V of vectorised projections.

    Entry i of a vector is axis i % 3 of row i // 3; row i // 3 belongs to element
    i // (3 * rows_per_element).

    V : (3 e p, rank); orthonormal (in the weighted inner product), or orthonormal axis by axis if
        ``separate_axes``
    mean : (3 e p,)
    singular_values : all singular values of the weighted, centred train matrix
    rank : number of singular values above round-off; V has no further columns
    roundoff : absolute size of a singular value that is noise
    active_axes : whether an axis carries anything above round-off
    origin : what error messages call the basis: its file
    """

    V: np.ndarray
    mean: np.ndarray
    singular_values: np.ndarray
    rank: int
    roundoff: float
    rows_per_element: int
    separate_axes: bool
    active_axes: tuple[bool, ...]
    origin: str = "basis"

    __repr__ = brief

    @property
    def elements(self) -> int:
        """Number of elements e."""
        return len(self.mean) // (3 * self.rows_per_element)

    def truncated(self, r: int) -> np.ndarray:
        """First r modes (3 e p, r); RankError if there are fewer."""
        if not 1 <= r <= self.rank:
            raise RankError(
                f"{self.origin}: r = {r}, the snapshots have numerical rank {self.rank} "
                f"(round-off {self.roundoff:.1e}), allowed are 1 to {self.rank}"
            )
        return self.V[:, :r]


_ARRAYS = ("V", "mean", "singular_values")
_ATTRIBUTES = ("rank", "roundoff", "rows_per_element", "separate_axes", "active_axes")


def save_basis(basis: Basis, path: str | os.PathLike[str]) -> None:
    """Write ``basis`` to the HDF5 file ``path``."""
    with write_hdf5(path) as file:
        for name in _ARRAYS:
            file[name] = getattr(basis, name)
        for name in _ATTRIBUTES:
            file.attrs[name] = getattr(basis, name)


def load_basis(path: str | os.PathLike[str]) -> Basis:
    """Read the file ``path`` by `save_basis`; StorageError if it is damaged."""
    with open_hdf5(path) as file:
        return Basis(
            **{name: file[name][...] for name in _ARRAYS},
            rank=int(file.attrs["rank"]),
            roundoff=float(file.attrs["roundoff"]),
            rows_per_element=int(file.attrs["rows_per_element"]),
            separate_axes=bool(file.attrs["separate_axes"]),
            active_axes=tuple(bool(a) for a in file.attrs["active_axes"]),
            origin=str(path),
        )
