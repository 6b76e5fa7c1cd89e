"""Meshes whose arrays are given from Python."""

import hashlib
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field

from pdrom.core.errors import MeshError
from pdrom.model.mesh.checks import check_indices, check_range
from pdrom.model.mesh.generators import boundary, orient
from pdrom.model.mesh.mesh_model import MeshModel
from pdrom.model.mesh.orientation import turned_alike
from pdrom.model.mesh.types import Mesh

_DIGITS = 32


class GivenMesh(MeshModel):
    """Arrays that were given from Python; the file of a run holds them, beside the configuration.

    blake2b : digest of the arrays, so that two meshes have two configurations
    """

    kind: Literal["given"]
    blake2b: Annotated[str, Field(pattern=rf"^[0-9a-f]{{{_DIGITS}}}$")]

    @classmethod
    def of(cls, mesh: Mesh) -> Self:
        """The configuration of a mesh."""
        digest = hashlib.blake2b(digest_size=_DIGITS // 2)
        for array in (mesh.points, mesh.triangles, mesh.tetrahedra):
            digest.update(f"{array.shape}".encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        return cls(kind="given", blake2b=digest.hexdigest())

    def coarsened(self, factor: float) -> Self:
        """The arrays themselves, whatever ``factor``: they have one resolution."""
        return self

    def build(self, root: Path) -> Mesh:
        """MeshError, whatever ``root``: there are no arrays in a configuration."""
        raise MeshError("mesh.kind = 'given': its arrays come from Python (pdrom.api.build_scene)")

    @property
    def label(self) -> str:
        """Readable part of the mesh's file name."""
        return "given"


def given_mesh(points: Any, cells: Any, name: str) -> Mesh:
    """Mesh of points (N, 3) m and of triangles (T, 3) or tetrahedra (E, 4); ``name`` opens errors.

    Triangles that face the other way than their neighbours, and corners of tetrahedra, are put
    into order. What else a mesh has to satisfy is checked when a scene is built.

    Parameters
    ----------
    cells : (T, 3) or (E, 4), counted from 0

    Raises
    ------
    MeshError
        Arrays of another shape or kind, an index out of range, a surface with one side only.
    """
    points = _array(points, f"{name}: points", np.float64, (3,))
    cells = _array(cells, f"{name}: cells", np.int64, (3, 4))
    if not len(points) or not len(cells):
        raise MeshError(f"{name}: {len(points)} points and {len(cells)} cells, both are required")
    check_range(points, 1.0, name)
    if cells.shape[1] == 4:
        check_indices(cells, len(points), "tetrahedron", name=name)
        tetrahedra = orient(points, cells)
        return Mesh(points, boundary(tetrahedra), tetrahedra)
    check_indices(cells, len(points), "triangle", name=name)
    turned = turned_alike(cells, name)
    triangles = np.where(turned[:, None], cells[:, ::-1], cells)
    return Mesh(points, triangles.astype(np.int32))


def _array(values: Any, name: str, kind: type[np.generic], widths: tuple[int, ...]) -> np.ndarray:
    """A copy of ``values`` as an array; whole numbers stay whole."""
    required = " or ".join(f"(n, {width})" for width in widths)
    try:
        array = np.array(values)
        if array.ndim != 2 or array.shape[1] not in widths:
            raise MeshError(f"{name} of shape {array.shape}, required: {required}")
        return np.ascontiguousarray(array.astype(kind, casting="same_kind"))
    except (TypeError, ValueError) as error:
        fault = " ".join(str(error).split())
        raise MeshError(f"{name}: an array {required} is required ({fault})") from error
