"""Named vertex selections, taken from the rest shape."""

import numpy as np

from pdrom.core.errors import SceneError
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
TOLERANCE = 1e-6  # of the extent


def select_vertices(mesh: Mesh, selection: str | tuple[int, ...] | list[int]) -> np.ndarray:
    """Vertex indices (n,) int64, ascending, of a side (see `SIDES`) or of an explicit list.

    Raises
    ------
    SceneError
        Unknown side, index out of range, a side that the mesh does not have (it is flat in this
        direction, so that every vertex would be chosen), or an empty selection.
    """
    if isinstance(selection, str):
        return _side(mesh, selection)
    if len(selection) == 0:
        raise SceneError("selection []: selects no vertex")
    outside = [index for index in selection if not 0 <= index < mesh.vertices]
    if outside:
        raise SceneError(f"selection holds {outside[0]}: allowed are 0 to {mesh.vertices - 1}")
    return np.unique(np.asarray(selection, dtype=np.int64))


def _side(mesh: Mesh, side: str) -> np.ndarray:
    if side not in SIDES:
        raise SceneError(f"selection '{side}': allowed are {', '.join(SIDES)} or vertex indices")
    axis, sign = SIDES[side]
    coordinate = sign * mesh.points[:, axis]
    if np.ptp(coordinate) <= TOLERANCE * mesh.extent:
        raise SceneError(f"selection '{side}': selects nothing, the mesh is flat along this axis")
    return np.flatnonzero(coordinate >= coordinate.max() - TOLERANCE * mesh.extent)


def farthest_points(points: np.ndarray, candidates: np.ndarray, count: int) -> np.ndarray:
    """``count`` of ``candidates`` by farthest-point sampling, starting nearest to the centre.

    Ties go to the smallest index, so that the order is deterministic.
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
