"""A half-space that vertices stay out of."""

from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from pdrom.model.effects.base import Vector
from pdrom.model.effects.bodies import square
from pdrom.model.effects.obstacle import Obstacle, ObstacleConfig
from pdrom.model.mesh.selection import require_direction
from pdrom.model.mesh.types import Mesh


class Plane(Obstacle):
    """Vertices stay on the side of a plane that its normal points to; see `Obstacle`."""

    class Config(ObstacleConfig):
        """``point`` on the plane in metres, ``normal`` of any length."""

        effect: Literal["plane"] = "plane"
        point: Vector = (0.0, 0.0, 0.0)
        normal: Vector = (0.0, 1.0, 0.0)

        @model_validator(mode="after")
        def _directed(self) -> Self:
            return require_direction(self)

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

    def entries(
        self, start: np.ndarray, end: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        above, below = np.maximum(-self.depths(start), 0.0), self.depths(end)
        hits = below > 0.0
        fraction = np.where(hits, above / np.where(hits, above + below, 1.0), 0.0)
        return hits, start + fraction[:, None] * (end - start), self.normals(start)
