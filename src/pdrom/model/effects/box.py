"""A box along the axes that vertices stay out of."""

from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from pdrom.model.effects.base import Vector
from pdrom.model.effects.bodies import cuboid
from pdrom.model.effects.obstacle import Obstacle, ObstacleConfig
from pdrom.model.mesh.selection import require_ordered
from pdrom.model.mesh.types import Mesh


class Box(Obstacle):
    """Vertices stay out of a box; see `Obstacle`. It may be as thin as a plate."""

    class Config(ObstacleConfig):
        """Corners ``lower`` and ``upper`` in metres."""

        effect: Literal["box"] = "box"
        lower: Vector
        upper: Vector

        @model_validator(mode="after")
        def _ordered(self) -> Self:
            return require_ordered(self)

        def body(self, low: np.ndarray, high: np.ndarray) -> Mesh:
            return cuboid(np.array(self.lower), np.array(self.upper))

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._lower, self._upper = np.array(config.lower), np.array(config.upper)

    def depths(self, points: np.ndarray) -> np.ndarray:
        return self._to_faces(points).min(axis=1)

    def _to_faces(self, points: np.ndarray) -> np.ndarray:
        """Distance (n, 6) to the lower and the upper faces, x, y, z; negative beyond them."""
        return np.hstack([points - self._lower, self._upper - points])

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Normals (n, 3) of the faces nearest to ``points`` (n, 3) m; of equals the first."""
        face = self._to_faces(points).argmin(axis=1)
        return _axis_vectors(face % 3, np.where(face < 3, -1.0, 1.0))

    def entries(
        self, start: np.ndarray, end: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Entries of straight paths from ``start`` to ``end`` (n, 3), see `Obstacle.entries`.

        A path enters where it has crossed the nearer faces of all three axes.
        """
        path, rows = end - start, np.arange(len(start))
        near_face = np.where(path > 0.0, self._lower, self._upper)
        far_face = np.where(path > 0.0, self._upper, self._lower)
        # a path that hardly moves along an axis, or not at all: between the faces from -inf to inf
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            near, far = (near_face - start) / path, (far_face - start) / path
            within = (start >= self._lower) & (start <= self._upper)
            near = np.where(path != 0.0, near, np.where(within, -np.inf, np.inf))
            far = np.where(path != 0.0, far, np.inf)
            axis = near.argmax(axis=1)
            fraction, moved = near[rows, axis], path[rows, axis]
            # a little inside the face still is on it
            on_face = fraction * np.abs(moved) >= -self._slack
        hits = (moved != 0.0) & on_face & (fraction <= 1.0) & (far.min(axis=1) >= fraction)
        points = start + np.clip(np.where(hits, fraction, 0.0), 0.0, None)[:, None] * path
        points[rows, axis] = near_face[rows, axis]
        return hits, points, _axis_vectors(axis, -np.sign(moved))


def _axis_vectors(axes: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) along the axes (n,) 0, 1 or 2."""
    return np.eye(3)[axes] * signs[:, None]
