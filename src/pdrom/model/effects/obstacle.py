"""Contacts of vertices with a plane, sphere or box, with Coulomb friction, and with a floor."""

from abc import abstractmethod
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from pdrom.model.effects.base import Contact, EffectConfig, Vector
from pdrom.model.mesh.selection import require_direction, require_ordered
from pdrom.model.mesh.types import Length, Mesh, PositiveLength

# A vertex inside an obstacle by at most this fraction of the mesh's longest side counts as outside.
SLACK = 1e-9

Entries = tuple[np.ndarray, np.ndarray, np.ndarray]
"""For n paths: whether each enters a body (n,), entry points (n, 3) m and outward unit normals
(n, 3) there; points and normals are meaningless for a path that does not enter."""


class ObstacleConfig(EffectConfig):
    """Coefficient mu of ``friction``: 0 for no friction, ``.inf`` (infinity) for sticking."""

    friction: Annotated[float, Field(ge=0.0)] = 0.0


class Obstacle(Contact):
    """A fixed convex body that vertices cannot enter; edges and faces of the mesh can.

    If the straight path of a vertex in a frame enters the body, the vertex continues in the tangent
    plane at the entry point, even if the path leaves the body again: fast vertices do not pass
    through. A vertex that is inside at the beginning of a frame moves to the nearest surface
    point. Both corrections move it by a depth d along the normal and shorten its tangential motion
    by mu d (at most to zero): Coulomb's law for the impulse m d / h. Impacts are inelastic.
    """

    def __init__(self, config: ObstacleConfig, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._slack = SLACK * mesh.extent

    def correct(self, positions: np.ndarray, before: np.ndarray) -> None:
        outside = self.depths(before) <= self._slack
        hits, entries, normals = self.entries(before, positions)
        hits &= outside
        if hits.any():
            base, n = entries[hits], normals[hits]
            left = positions[hits] - base
            depth = -np.einsum("ij,ij->i", left, n)
            along = left + depth[:, None] * n
            positions[hits] = base + self._braked(along, depth)
        depths = self.depths(positions)
        inside = np.flatnonzero(~hits & (depths > 0.0))
        if len(inside):
            n, depth = self.normals(positions[inside]), depths[inside]
            lifted = positions[inside] + depth[:, None] * n
            moved = lifted - before[inside]
            along = moved - np.einsum("ij,ij->i", moved, n)[:, None] * n
            positions[inside] = lifted - along + self._braked(along, depth)

    def _braked(self, along: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Return ``along`` (n, 3) m, tangential displacements, shortened by mu ``depth`` (n,) m."""
        mu = self.config.friction
        if mu == 0.0:
            return along
        length = np.linalg.norm(along, axis=1)
        most = np.where(depth > 0.0, mu, 0.0) * np.maximum(depth, np.finfo(float).tiny)
        left = np.maximum(length - most, 0.0) / np.where(length > 0.0, length, 1.0)
        return left[:, None] * along

    @abstractmethod
    def depths(self, points: np.ndarray) -> np.ndarray:
        """Return depths (n,) m of ``points`` (n, 3) m below the surface; <= 0 outside."""

    @abstractmethod
    def normals(self, points: np.ndarray) -> np.ndarray:
        """Return outward unit normals (n, 3) at surface points nearest to the inner ``points``."""

    @abstractmethod
    def entries(self, start: np.ndarray, end: np.ndarray) -> Entries:
        """Return where paths from ``start`` (n, 3) m (outside) to ``end`` enter the body."""


class Plane(Obstacle):
    """Obstacle: the half space behind a plane, which vertices cannot enter."""

    class Config(ObstacleConfig):
        """``point`` on the plane in metres, ``normal`` of any length."""

        effect: Literal["plane"] = "plane"
        point: Vector = (0.0, 0.0, 0.0)
        normal: Vector = (0.0, 1.0, 0.0)

        _directed = model_validator(mode="after")(require_direction)

        def body(self, low: np.ndarray, high: np.ndarray) -> Mesh:
            return square(np.array(self.point), np.array(self.normal), low, high=high)

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._point = np.array(config.point)
        self._normal = np.array(config.normal) / np.linalg.norm(config.normal)

    def depths(self, points: np.ndarray) -> np.ndarray:
        return -((points - self._point) @ self._normal)

    def normals(self, points: np.ndarray) -> np.ndarray:
        return np.tile(self._normal, (len(points), 1))

    def entries(self, start: np.ndarray, end: np.ndarray) -> Entries:
        above, below = np.maximum(-self.depths(start), 0.0), self.depths(end)
        hits = below > 0.0
        fraction = np.where(hits, above / np.where(hits, above + below, 1.0), 0.0)
        return hits, start + fraction[:, None] * (end - start), self.normals(start)


UP = np.array([0.0, 1.0, 0.0])


class Sphere(Obstacle):
    """Obstacle: a sphere, which vertices cannot enter."""

    class Config(ObstacleConfig):
        """``centre`` and ``radius`` in metres."""

        effect: Literal["sphere"] = "sphere"
        centre: Vector
        radius: PositiveLength

        def body(self, low: np.ndarray, high: np.ndarray) -> Mesh:
            return ball(np.array(self.centre), self.radius)

    def depths(self, points: np.ndarray) -> np.ndarray:
        return self.config.radius - np.linalg.norm(points - self.config.centre, axis=1)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Return outward unit normals (n, 3) at ``points`` (n, 3) m; upwards at the centre."""
        arm = points - self.config.centre
        length = np.linalg.norm(arm, axis=1)[:, None]
        return np.where(length > 0.0, arm / np.where(length > 0.0, length, 1.0), UP)

    def entries(self, start: np.ndarray, end: np.ndarray) -> Entries:
        """Return `Entries` at the least t with |start + t (end - start) - centre| = radius."""
        arm, path = start - self.config.centre, end - start
        square = np.einsum("ij,ij->i", path, path)
        inwards = -np.einsum("ij,ij->i", arm, path)
        outside = np.einsum("ij,ij->i", arm, arm) - self.config.radius**2
        root = inwards**2 - square * outside
        meets = (inwards > 0.0) & (root >= 0.0)
        # t = outside / divisor; (inwards - sqrt(root)) / square would lose digits near the surface
        divisor = np.where(meets, inwards + np.sqrt(np.where(meets, root, 0.0)), 1.0)
        fraction = np.clip(np.where(meets, outside / divisor, 0.0), 0.0, None)
        points = start + fraction[:, None] * path
        return meets & (fraction <= 1.0), points, self.normals(points)


class Box(Obstacle):
    """Obstacle: a box, possibly as thin as a plate, which vertices cannot enter."""

    class Config(ObstacleConfig):
        """Corners ``lower`` and ``upper`` in metres."""

        effect: Literal["box"] = "box"
        lower: Vector
        upper: Vector

        _ordered = model_validator(mode="after")(require_ordered)

        def body(self, low: np.ndarray, high: np.ndarray) -> Mesh:
            lower, upper = np.array(self.lower), np.array(self.upper)
            upwards = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
            triangles = [[f[0], *pair] for f in FACES for pair in (f[1:3], f[2:4])]
            return Mesh(lower + upwards * (upper - lower), np.array(triangles, dtype=np.int32))

    def depths(self, points: np.ndarray) -> np.ndarray:
        return self._to_faces(points).min(axis=1)

    def _to_faces(self, points: np.ndarray) -> np.ndarray:
        """Return distances (n, 6) m to the lower x, y, z and upper x, y, z faces; < 0 outside."""
        return np.hstack([points - self.config.lower, self.config.upper - points])

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Return normals (n, 3) of the faces nearest to ``points``; ties: the first face."""
        face = self._to_faces(points).argmin(axis=1)
        return np.eye(3)[face % 3] * np.where(face < 3, -1.0, 1.0)[:, None]

    def entries(self, start: np.ndarray, end: np.ndarray) -> Entries:
        """Return the `Entries` of straight paths from ``start`` to ``end`` (n, 3) m.

        A path enters the box at the last of its crossings with the nearer face of each axis.
        """
        path, rows = end - start, np.arange(len(start))
        lower, upper = np.array(self.config.lower), np.array(self.config.upper)
        near_face = np.where(path > 0.0, lower, upper)
        far_face = np.where(path > 0.0, upper, lower)
        # parallel to two faces, a path is between them for all t (near = -inf) or none (near = inf)
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            near, far = (near_face - start) / path, (far_face - start) / path
            within = (start >= lower) & (start <= upper)
            near = np.where(path != 0.0, near, np.where(within, -np.inf, np.inf))
            far = np.where(path != 0.0, far, np.inf)
            axis = near.argmax(axis=1)
            fraction, moved = near[rows, axis], path[rows, axis]
            # a start that is inside a face only by rounding errors counts as a point on it
            on_face = fraction * np.abs(moved) >= -self._slack
        hits = (moved != 0.0) & on_face & (fraction <= 1.0) & (far.min(axis=1) >= fraction)
        points = start + np.clip(np.where(hits, fraction, 0.0), 0.0, None)[:, None] * path
        points[rows, axis] = near_face[rows, axis]
        return hits, points, np.eye(3)[axis] * -np.sign(moved)[:, None]


RINGS = 24  # intervals of a drawn sphere from pole to pole; there are twice as many around it
# Corners of the faces of a drawn box; corner 4 i + 2 j + k is at the upper x if i = 1, and so on.
FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def square(point: np.ndarray, normal: np.ndarray, low: np.ndarray, high: np.ndarray) -> Mesh:
    """Return a square to draw the plane through ``point`` near the box from ``low`` to ``high``, m.

    Its centre is the centre of the box projected onto the plane, its side the box diagonal.
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
    """Return a triangulated sphere with vertices at ``radius`` m from ``centre`` (3,) m."""
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


class Floor(Contact):
    """Horizontal floor: at the end of a frame, vertices below it are moved up onto it.

    Velocities are computed from the corrected positions, so that impacts are inelastic. As the
    floor acts after the iterations, it does not change the objective of the local/global steps.
    """

    class Config(EffectConfig):
        """``height`` y of the floor in metres."""

        effect: Literal["floor"] = "floor"
        height: Length = 0.0

        def body(self, low: np.ndarray, high: np.ndarray) -> Mesh:
            return square(np.array([0.0, self.height, 0.0]), UP, low, high=high)

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.height = config.height

    def correct(self, positions: np.ndarray, before: np.ndarray) -> None:
        np.maximum(positions[:, 1], self.config.height, out=positions[:, 1])
