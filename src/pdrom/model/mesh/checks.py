"""Checks of a mesh before any computation, and a consistent orientation of its cells."""

import logging

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

from pdrom.core.errors import DegenerateElementError, MeshError
from pdrom.core.store import require_finite
from pdrom.model.mesh.generators import boundary, orient
from pdrom.model.mesh.types import MAX_LENGTH, MIN_LENGTH, Mesh

log = logging.getLogger(__name__)

# An element is degenerate if its area is below this times its longest edge^2 (volume: edge^3).
RELATIVE_MEASURE = 1e-12

# Vertices that are closer than this fraction of the mesh's extent may belong to an open seam.
SEAM = 1e-6


def check_mesh(mesh: Mesh, name: str) -> Mesh:
    """Return ``mesh``; raise an error for its first fault, with ``name`` in front of the message.

    MeshError: no cells, indices out of range, NaN or Inf, unreferenced or repeated vertices, a
    repeated element, an edge of more than two triangles or a face of more than two tetrahedra.
    DegenerateElementError: an element with a repeated vertex, or zero area or volume at rest.
    """
    cells = mesh.tetrahedra if len(mesh.tetrahedra) else mesh.triangles
    kind = "tetrahedron" if len(mesh.tetrahedra) else "triangle"
    if len(cells) == 0:
        raise MeshError(f"{name}: neither triangles nor tetrahedra")
    require_finite(f"{name}: points", mesh.points, MeshError)
    check_indices(cells, mesh.vertices, kind, name=name)
    _check_neighbours(cells, kind, name)
    _check_vertices(mesh, cells, name)
    _check_measures(mesh, cells, kind, name)
    return mesh


def mesh_of(points: np.ndarray, cells: np.ndarray, name: str) -> Mesh:
    """Return a mesh of ``points`` (N, 3) m, ``cells`` (n, 3 or 4); tetrahedra get volumes > 0.

    MeshError, beginning with ``name``, if an index is out of range or repeated in a cell.
    """
    if cells.shape[1] == 3:
        check_indices(cells, len(points), "triangle", name=name)
        return Mesh(points, cells.astype(np.int32))
    check_indices(cells, len(points), "tetrahedron", name=name)
    # make volumes positive: file formats order the corners of a tetrahedron differently
    tetrahedra = orient(points, cells)
    return Mesh(points, boundary(tetrahedra), tetrahedra)


def check_indices(cells: np.ndarray, vertices: int, kind: str, name: str) -> None:
    """Raise MeshError for an index out of range, DegenerateElementError if repeated in a cell.

    cells : (E, corners) vertex indices; 0 to ``vertices`` - 1 are allowed
    kind, name : kind of the cells and name of the mesh, for messages
    """
    outside = np.flatnonzero(((cells < 0) | (cells >= vertices)).any(axis=1))
    if len(outside):
        raise MeshError(
            f"{name}: {kind} {outside[0]} has the corners {cells[outside[0]].tolist()}, "
            f"allowed: 0 to {vertices - 1}"
        )
    ordered = np.sort(cells, axis=1)
    twice = np.flatnonzero((np.diff(ordered, axis=1) == 0).any(axis=1))
    if len(twice):
        raise DegenerateElementError(
            f"{name}: {kind} {twice[0]} has a corner twice: {cells[twice[0]].tolist()}"
        )


def check_range(points: np.ndarray, scale: float, name: str) -> None:
    """Raise MeshError if a coordinate exceeds `MAX_LENGTH` or the longest side is < `MIN_LENGTH`.

    Squares of larger or smaller lengths would overflow or lose all digits.

    points : (N, 3), in metres after the multiplication by ``scale``
    name : name of the mesh, for messages
    """
    limit = MAX_LENGTH / scale
    outside = np.flatnonzero(~(np.abs(points) <= limit).all(axis=1))
    if len(outside):
        raise MeshError(
            f"{name}: vertex {outside[0]} lies at {points[outside[0]].tolist()}, allowed are "
            f"coordinates from {-limit:g} to {limit:g}"
        )
    extent = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    if extent < MIN_LENGTH / scale:
        raise MeshError(
            f"{name}: extent {extent:g} (longest side of the bounding box), allowed is at least "
            f"{MIN_LENGTH / scale:g}"
        )


def _check_neighbours(cells: np.ndarray, kind: str, name: str) -> None:
    twice = _largest_group(np.sort(cells, axis=1))
    if len(twice) > 1:
        first, again = twice[:2]
        raise MeshError(
            f"{name}: {kind} {again} {cells[again].tolist()} repeats {kind} {first} "
            f"{cells[first].tolist()}"
        )
    corners = cells.shape[1]
    each = [np.delete(cells, corner, axis=1) for corner in range(corners)]
    sides = np.sort(np.concatenate(each), axis=1)
    shared = _largest_group(sides)
    if len(shared) > 2:
        side, owners = ("edge", "triangles") if corners == 3 else ("face", "tetrahedra")
        raise MeshError(
            f"{name}: {side} {sides[shared[0]].tolist()} belongs to {len(shared)} {owners}, "
            "allowed: at most 2"
        )


def _largest_group(rows: np.ndarray) -> np.ndarray:
    """Return indices, ascending, of all copies of the most frequent row; ties: the smallest row."""
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = (ordered[1:] != ordered[:-1]).any(axis=1)
    starts = np.concatenate([[0], np.flatnonzero(new) + 1])
    counts = np.diff(starts, append=len(rows))
    largest = np.argmax(counts)
    return order[starts[largest] :][: counts[largest]]


def _check_vertices(mesh: Mesh, cells: np.ndarray, name: str) -> None:
    used = np.zeros(mesh.vertices, dtype=bool)
    used[cells] = True
    if not used.all():
        unused = np.flatnonzero(~used)
        raise MeshError(
            f"{name}: vertices in no element: {len(unused)}, the first is {unused[0]}; "
            f"for a mesh file, `merge: {SEAM:.1e}` below `mesh` leaves them out"
        )
    _, first, inverse = np.unique(mesh.points, axis=0, return_index=True, return_inverse=True)
    original = first[inverse.ravel()]
    if len(first) < mesh.vertices:
        repeated = np.flatnonzero(original != np.arange(mesh.vertices))[0]
        raise MeshError(
            f"{name}: vertex {repeated} repeats the position of vertex {original[repeated]}; "
            f"for a mesh file, `merge: {SEAM:.1e}` below `mesh` merges them"
        )


def _check_measures(mesh: Mesh, cells: np.ndarray, kind: str, name: str) -> None:
    corner = mesh.points[cells]
    edges = corner[:, 1:] - corner[:, :1]
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    # scale the longest edge to one; the Gram determinant, the square of area or volume, would
    # consist of rounding errors where these are below 1e-8
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


def seams(mesh: Mesh) -> str:
    """Return how many connected parts ``mesh`` has, and how many pairs of vertices are close."""
    edges = mesh.edges()
    graph = sparse.coo_array((np.ones(len(edges)), edges.T), shape=2 * (mesh.vertices,))
    parts = csgraph.connected_components(graph, directed=False)[0]
    tree = cKDTree(mesh.points)
    pairs = (tree.count_neighbors(tree, SEAM * mesh.extent) - mesh.vertices) // 2
    text = f"{parts} connected part{'s' * (parts > 1)}"
    if pairs:
        text += f", {pairs} pairs of vertices closer than {SEAM:g} of the extent"
    return text


def merged(mesh: Mesh, tolerance: float, name: str) -> Mesh:
    """Return ``mesh`` with vertices that are closer than ``tolerance`` m merged into the first.

    Elements in which two vertices become one, and vertices in no element, are left out. Messages
    begin with ``name``.
    """
    pairs = cKDTree(mesh.points).query_pairs(tolerance, output_type="ndarray")
    graph = sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=2 * (mesh.vertices,))
    count, part = csgraph.connected_components(graph, directed=False)
    _, first = np.unique(part, return_index=True)
    place = np.empty(count, dtype=np.int64)
    place[np.argsort(first)] = np.arange(count)
    cells = place[part][mesh.tetrahedra if len(mesh.tetrahedra) else mesh.triangles]
    whole = (np.diff(np.sort(cells, axis=1), axis=1) > 0).all(axis=1)
    used, corners = np.unique(cells[whole], return_inverse=True)
    log.warning(
        "%s: %d vertices are merged into %d; left out are %d elements that become flat and %d "
        "vertices in no element",
        name, mesh.vertices, count, len(cells) - whole.sum(), count - len(used),
    )  # fmt: skip
    return mesh_of(mesh.points[np.sort(first)[used]], corners.reshape(-1, cells.shape[1]), name)


def turned_alike(mesh: Mesh, name: str) -> tuple[Mesh, np.ndarray]:
    """Return the surface with consistent orientation, and the indices (n,) of reversed triangles.

    In each connected part of ``mesh`` the smaller number of triangles is reversed. A graph has two
    nodes per triangle (as given, reversed), joined to the nodes of neighbours with consistent
    orientation. A part is orientable if its nodes form two connected components.

    Raises MeshError, beginning with ``name``, if a part is not orientable (a Möbius strip).
    """
    triangles, t = mesh.triangles, len(mesh.triangles)
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    order = np.lexsort(np.sort(edges, axis=1).T)
    ends = np.sort(edges, axis=1)[order]
    second = 1 + np.flatnonzero((ends[1:] == ends[:-1]).all(axis=1))
    a, b = order[second - 1] // 3, order[second] // 3
    # neighbours are consistent if they traverse their common edge in opposite directions
    opposite = edges[order[second - 1], 0] == edges[order[second], 0]
    pairs = np.concatenate(
        [np.column_stack([a, b + t * opposite]), np.column_stack([a + t, b + t * ~opposite])]
    )
    graph = sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(2 * t, 2 * t))
    labels = csgraph.connected_components(graph, directed=False)[1].reshape(2, t)
    if (labels[0] == labels[1]).any():
        first = np.flatnonzero(labels[0] == labels[1])[0]
        raise MeshError(
            f"{name}: the surface around triangle {first} {triangles[first].tolist()} has one side "
            "only, so that its triangles cannot be oriented consistently"
        )
    part, side = np.min(labels, axis=0), labels[0] > labels[1]
    count = np.bincount(part, side, minlength=2 * t)
    turned = side ^ (2.0 * count > np.bincount(part, minlength=2 * t))[part]
    alike = np.where(turned[:, None], triangles[:, ::-1], triangles)
    return Mesh(mesh.points, alike), np.flatnonzero(turned)
