"""The vertices of a selection, taken from the rest shape."""

from collections.abc import Callable
from functools import reduce
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from pdrom.core.errors import SceneError
from pdrom.model.mesh import selection as kinds
from pdrom.model.mesh.measures import boundary_edges
from pdrom.model.mesh.types import Mesh

# side name -> (axis, +1 for the maximal side, -1 for the minimal one)
SIDES = {
    "left": (0, -1),
    "right": (0, 1),
    "bottom": (1, -1),
    "top": (1, 1),
    "back": (2, -1),
    "front": (2, 1),
}
TOLERANCE = 1e-6  # relative to the extent


def select_vertices(mesh: Mesh, selection: kinds.Selection) -> np.ndarray:
    """Vertex indices (n,) int64, ascending, of a side (see `SIDES`), a list, or a shape.

    Raises
    ------
    SceneError
        Unknown side, index out of range, a side that the mesh does not have (it is flat in this
        direction, so that every vertex would be chosen), a loop or component that it does not
        have, or an empty selection.
    """
    chosen = _chosen(mesh, selection)
    if len(chosen) == 0:
        shown = list(selection) if isinstance(selection, tuple | list) else selection
        raise SceneError(f"selection {shown}: selects no vertex")
    return chosen.astype(np.int64)


def _chosen(mesh: Mesh, selection: kinds.Selection) -> np.ndarray:
    """Vertices by `select_vertices`, but a selection may be empty."""
    if isinstance(selection, str):
        return _side(mesh, selection)
    if isinstance(selection, (tuple, list)):
        return _listed(mesh, selection)
    return _FINDERS[type(selection)](mesh, selection)


def _listed(mesh: Mesh, indices: tuple[int, ...] | list[int]) -> np.ndarray:
    outside = [index for index in indices if not 0 <= index < mesh.vertices]
    if outside:
        raise SceneError(f"selection holds {outside[0]}: allowed are 0 to {mesh.vertices - 1}")
    return np.unique(np.asarray(indices, dtype=np.int64))


def _side(mesh: Mesh, side: str) -> np.ndarray:
    if side not in SIDES:
        raise SceneError(f"selection '{side}': allowed are {', '.join(SIDES)} or vertex indices")
    axis, sign = SIDES[side]
    coordinate = sign * mesh.points[:, axis]
    if np.ptp(coordinate) <= TOLERANCE * mesh.extent:
        raise SceneError(f"selection '{side}': selects nothing, the mesh is flat along this axis")
    return np.flatnonzero(coordinate >= coordinate.max() - TOLERANCE * mesh.extent)


def _box(mesh: Mesh, box: kinds.Box) -> np.ndarray:
    slack = TOLERANCE * mesh.extent
    above = mesh.points >= np.array(box.lower) - slack
    return np.flatnonzero((above & (mesh.points <= np.array(box.upper) + slack)).all(axis=1))


def _sphere(mesh: Mesh, sphere: kinds.Sphere) -> np.ndarray:
    distance = np.linalg.norm(mesh.points - np.array(sphere.centre), axis=1)
    return np.flatnonzero(distance <= sphere.radius + TOLERANCE * mesh.extent)


def _plane(mesh: Mesh, plane: kinds.Plane) -> np.ndarray:
    normal = np.array(plane.normal) / np.linalg.norm(plane.normal)
    height = (mesh.points - np.array(plane.point)) @ normal
    return np.flatnonzero(height >= -TOLERANCE * mesh.extent)


def _nearest(mesh: Mesh, nearest: kinds.Nearest) -> np.ndarray:
    if nearest.count > mesh.vertices:
        raise SceneError(f"selection nearest: count = {nearest.count} of {mesh.vertices} vertices")
    distance = _distance(mesh.points, np.array(nearest.point))
    return np.sort(np.argsort(distance, kind="stable")[: nearest.count])


def _boundary_loop(mesh: Mesh, loop: kinds.BoundaryLoop) -> np.ndarray:
    border = boundary_edges(mesh.triangles)
    lengths = np.linalg.norm(mesh.points[border[:, 0]] - mesh.points[border[:, 1]], axis=1)
    # half of an edge for each of its ends
    shares = np.bincount(border.ravel(), np.repeat(lengths / 2.0, 2), minlength=mesh.vertices)
    return _part(mesh, border, np.unique(border), shares, "boundary loop", loop.index)


def _component(mesh: Mesh, component: kinds.Component) -> np.ndarray:
    every = np.arange(mesh.vertices)
    return _part(mesh, mesh.edges(), every, np.ones(len(every)), "component", component.index)


def _part(
    mesh: Mesh, edges: np.ndarray, among: np.ndarray, sizes: np.ndarray, what: str, index: int
) -> np.ndarray:
    """Number ``index`` of the connected parts of a graph on the vertices ``among``.

    The largest sum of ``sizes`` (N,) comes first, of equal ones that with the smallest vertex.
    """
    n = mesh.vertices
    graph = sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
    labels = csgraph.connected_components(graph, directed=False)[1][among]
    parts = [among[labels == label] for label in np.unique(labels)]
    # rounded, so that symmetric sizes tie exactly on every machine
    parts.sort(key=lambda part: (-round(float(sizes[part].sum()) / mesh.extent, 9), part[0]))
    if index >= len(parts):
        raise SceneError(f"selection {what}: index = {index}, the mesh has {len(parts)}")
    return parts[index]


def _union(mesh: Mesh, union: kinds.Union) -> np.ndarray:
    return reduce(np.union1d, [_chosen(mesh, part) for part in union.of])


def _intersection(mesh: Mesh, intersection: kinds.Intersection) -> np.ndarray:
    return reduce(np.intersect1d, [_chosen(mesh, part) for part in intersection.of])


def _complement(mesh: Mesh, complement: kinds.Complement) -> np.ndarray:
    return np.setdiff1d(np.arange(mesh.vertices), _chosen(mesh, complement.of))


_FINDERS: dict[type, Callable[[Mesh, Any], np.ndarray]] = {
    kinds.Box: _box,
    kinds.Sphere: _sphere,
    kinds.Plane: _plane,
    kinds.Nearest: _nearest,
    kinds.BoundaryLoop: _boundary_loop,
    kinds.Component: _component,
    kinds.Union: _union,
    kinds.Intersection: _intersection,
    kinds.Complement: _complement,
}


def farthest_points(points: np.ndarray, candidates: np.ndarray, count: int) -> np.ndarray:
    """``count`` of ``candidates`` (n,) by farthest-point sampling, the first nearest the centre.

    Ties go to the smallest index, so that the order is deterministic.

    Parameters
    ----------
    points : (N, 3) m
    """
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    chosen = [int(candidates[np.argmin(_distance(points[candidates], centre))])]
    nearest = _distance(points[candidates], points[chosen[0]])
    while len(chosen) < count:
        chosen.append(int(candidates[np.argmax(nearest)]))
        nearest = np.minimum(nearest, _distance(points[candidates], points[chosen[-1]]))
    return np.array(chosen)


def _distance(points: np.ndarray, point: np.ndarray) -> np.ndarray:
    # rounded, so that symmetric distances tie exactly on every machine
    return np.round(np.linalg.norm(points - point, axis=1), 12)
