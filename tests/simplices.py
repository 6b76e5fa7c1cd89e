"""Groups of separate unit simplices, whose S q is F^T, so that F is chosen freely."""

import numpy as np

from pdrom.model.mesh.types import Mesh


def simplices(rows: int, count: int) -> Mesh:
    """``count`` separate unit simplices with ``rows`` + 1 vertices."""
    corners = np.eye(4, 3, k=-1)[: rows + 1]
    cells = np.arange(count * (rows + 1), dtype=np.int32).reshape(count, rows + 1)
    points = np.tile(corners, (count, 1))
    if rows == 3:
        return Mesh(points, np.empty((0, 3), dtype=np.int32), cells)
    return Mesh(points, cells)


def bound(kind: type, rows: int, count: int, **settings: float):
    """A group of ``count`` unit simplices."""
    mesh = simplices(rows, count)
    return kind(kind.Config(weight=1.0, **settings), mesh, np.ones(mesh.vertices))


def projected(group, f: np.ndarray) -> np.ndarray:
    """Projections (e, rows, 3) of the group's elements at F^T = f."""
    y = np.concatenate([np.zeros((len(f), 1, 3)), f], axis=1).reshape(-1, 3)
    return group.project(y).reshape(f.shape)
