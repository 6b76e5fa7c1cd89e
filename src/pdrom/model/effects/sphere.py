"""A ball that vertices stay out of."""

from typing import Literal

import numpy as np

from pdrom.model.effects.base import Vector
from pdrom.model.effects.bodies import ball
from pdrom.model.effects.obstacle import Obstacle, ObstacleConfig
from pdrom.model.mesh.lengths import PositiveLength
from pdrom.model.mesh.types import Mesh

UP = np.array([0.0, 1.0, 0.0])


class Sphere(Obstacle):
    """Vertices stay out of a ball; see `Obstacle`."""

    class Config(ObstacleConfig):
        """``centre`` and ``radius`` in metres."""

        effect: Literal["sphere"] = "sphere"
        centre: Vector
        radius: PositiveLength

        def body(self, low: np.ndarray, high: np.ndarray) -> Mesh:
            return ball(np.array(self.centre), self.radius)

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._centre = np.array(config.centre)

    def depths(self, points: np.ndarray) -> np.ndarray:
        return self.config.radius - np.linalg.norm(points - self._centre, axis=1)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Normals (n, 3) at ``points`` (n, 3) m, at the centre itself upwards."""
        arm = points - self._centre
        length = np.linalg.norm(arm, axis=1)[:, None]
        return np.where(length > 0.0, arm / np.where(length > 0.0, length, 1.0), UP)

    def entries(
        self, start: np.ndarray, end: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Smaller root t of |start + t (end - start) - centre| = radius, if in [0, 1]."""
        arm, path = start - self._centre, end - start
        square = np.einsum("ij,ij->i", path, path)
        inwards = -np.einsum("ij,ij->i", arm, path)
        outside = np.einsum("ij,ij->i", arm, arm) - self.config.radius**2
        root = inwards**2 - square * outside
        meets = (inwards > 0.0) & (root >= 0.0)
        # not the difference of inwards and the root, which cancel near the surface
        divisor = np.where(meets, inwards + np.sqrt(np.where(meets, root, 0.0)), 1.0)
        fraction = np.clip(np.where(meets, outside / divisor, 0.0), 0.0, None)
        points = start + fraction[:, None] * path
        return meets & (fraction <= 1.0), points, self.normals(points)
