"""Surfaces of obstacles for pictures."""

import numpy as np

from pdrom.model.mesh.types import Mesh

RINGS = 24  # steps of a ball from pole to pole; twice as many corners around


def square(point: np.ndarray, normal: np.ndarray, low: np.ndarray, high: np.ndarray) -> Mesh:
    """The part of a plane that is seen from the region between ``low`` and ``high`` (3,) m.

    A square about the middle of the region, seen along the normal, that covers it from every side.

    Parameters
    ----------
    point : (3,) m, on the plane
    normal : (3,)
    """
    normal = normal / np.linalg.norm(normal)
    middle, reach = 0.5 * (low + high), np.linalg.norm(high - low)
    centre = middle + ((point - middle) @ normal) * normal
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    along = np.cross(normal, across)
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    points = centre + 0.5 * reach * corners @ np.stack([across, along])
    return Mesh(points, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))


def ball(centre: np.ndarray, radius: float) -> Mesh:
    """A sphere about ``centre`` (3,) m in circles of latitude; corners at ``radius`` m."""
    around = 2 * RINGS
    polar = np.pi * np.arange(1, RINGS)[:, None] / RINGS
    turn = 2.0 * np.pi * np.arange(around)[None] / around
    x, z = np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn)
    circles = np.stack([x, np.cos(polar) + 0.0 * turn, z], axis=2).reshape(-1, 3)
    unit = np.vstack([circles, [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]])
    top, bottom, here = len(circles), len(circles) + 1, np.arange(around)
    after = (here + 1) % around
    faces = [np.column_stack([np.full(around, top), after, here])]
    for ring in range(RINGS - 2):
        a, b = ring * around + here, ring * around + after
        faces += [np.column_stack([a, b, a + around]), np.column_stack([b, b + around, a + around])]
    last = (RINGS - 2) * around
    faces.append(np.column_stack([np.full(around, bottom), last + here, last + after]))
    return Mesh(centre + radius * unit, np.concatenate(faces).astype(np.int32))


def cuboid(lower: np.ndarray, upper: np.ndarray) -> Mesh:
    """A box along the axes between the corners ``lower`` and ``upper`` (3,) m."""
    upwards = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [[f[0], *pair] for f in faces for pair in (f[1:3], f[2:4])]
    return Mesh(lower + upwards * (upper - lower), np.array(triangles, dtype=np.int32))
