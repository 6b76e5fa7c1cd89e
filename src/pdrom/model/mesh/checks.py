"""What a mesh must satisfy before anything is computed on it."""

import numpy as np

from pdrom.core.errors import DegenerateElementError, MeshError
from pdrom.core.store import require_finite
from pdrom.model.mesh.types import Mesh

# An element is degenerate when its measure is below this fraction of its longest edge's power.
RELATIVE_MEASURE = 1e-12


def check_mesh(mesh: Mesh, name: str) -> Mesh:
    """Return ``mesh`` or raise the first fault found; ``name`` opens the message.

    Raises
    ------
    MeshError
        No cells, indices out of range, NaN or Inf, unreferenced or repeated vertices, an element
        that names a vertex twice.
    DegenerateElementError
        A triangle of zero area or a tetrahedron of zero volume at rest.
    """
    cells = mesh.tetrahedra if len(mesh.tetrahedra) else mesh.triangles
    kind = "tetrahedron" if len(mesh.tetrahedra) else "triangle"
    if len(cells) == 0:
        raise MeshError(f"{name}: no triangles and no tetrahedra")
    require_finite(f"{name}: points", mesh.points, MeshError)
    check_indices(cells, mesh.vertices, kind, name)
    _check_vertices(mesh, cells, name)
    _check_measures(mesh, cells, kind, name)
    return mesh


def check_indices(cells: np.ndarray, vertices: int, kind: str, name: str) -> None:
    """MeshError for an index out of range, DegenerateElementError for one given twice."""
    outside = np.flatnonzero(((cells < 0) | (cells >= vertices)).any(axis=1))
    if len(outside):
        raise MeshError(
            f"{name}: {kind} {outside[0]} names vertex {cells[outside[0]].tolist()}, "
            f"allowed: 0 to {vertices - 1}"
        )
    ordered = np.sort(cells, axis=1)
    twice = np.flatnonzero((np.diff(ordered, axis=1) == 0).any(axis=1))
    if len(twice):
        raise DegenerateElementError(
            f"{name}: {kind} {twice[0]} names a vertex twice: {cells[twice[0]].tolist()}"
        )


def _check_vertices(mesh: Mesh, cells: np.ndarray, name: str) -> None:
    used = np.zeros(mesh.vertices, dtype=bool)
    used[cells] = True
    if not used.all():
        unused = np.flatnonzero(~used)
        raise MeshError(f"{name}: {len(unused)} vertices in no element, the first is {unused[0]}")
    _, first, inverse = np.unique(mesh.points, axis=0, return_index=True, return_inverse=True)
    original = first[inverse.ravel()]
    if len(first) < mesh.vertices:
        repeated = np.flatnonzero(original != np.arange(mesh.vertices))[0]
        raise MeshError(
            f"{name}: vertex {repeated} repeats the position of vertex {original[repeated]}"
        )


def _check_measures(mesh: Mesh, cells: np.ndarray, kind: str, name: str) -> None:
    corner = mesh.points[cells]
    edges = corner[:, 1:] - corner[:, :1]
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    # of edges of length one: the measure itself, not a Gram determinant, which is its square and
    # drowns in round-off below 1e-8
    edges = edges / longest[:, None, None]
    normal = np.cross(edges[:, 0], edges[:, 1])
    if kind == "triangle":
        measure = np.linalg.norm(normal, axis=1)
    else:
        measure = np.abs(np.einsum("ij,ij->i", normal, edges[:, 2]))
    flat = np.flatnonzero(measure <= RELATIVE_MEASURE)
    if len(flat):
        what = "volume" if kind == "tetrahedron" else "area"
        raise DegenerateElementError(
            f"{name}: {kind} {flat[0]} {cells[flat[0]].tolist()} has zero {what}"
        )
