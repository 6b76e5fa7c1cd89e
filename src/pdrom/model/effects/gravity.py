"""Uniform acceleration."""

from collections.abc import Sequence
from typing import Literal, Self

import numpy as np

from pdrom.model.effects.base import EffectConfig, Force, Vector
from pdrom.model.mesh.types import Mesh


class Gravity(Force):
    """An equal acceleration for every vertex."""

    class Config(EffectConfig):
        """``acceleration`` in m/s^2."""

        effect: Literal["gravity"] = "gravity"
        acceleration: Vector = (0.0, -9.81, 0.0)

        def tilted(self, degrees: float, axes: Sequence[int]) -> Self:
            own = np.array(self.acceleration)
            size = float(np.linalg.norm(own))
            axis = min(axes, key=lambda axis: abs(own[axis]))
            if abs(own[axis]) == size:  # nothing to turn, or no other axis
                return self
            side = size * np.eye(3)[axis] - own[axis] / size * own
            side *= size / np.linalg.norm(side)
            angle = np.radians(degrees)
            turned = np.cos(angle) * own + np.sin(angle) * side
            return self.model_copy(update={"acceleration": tuple(map(float, turned))})

    rate = 0.0

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._acceleration = np.array(config.acceleration)

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        return self._acceleration

    def potential(self, positions: np.ndarray, masses: np.ndarray) -> float:
        return -float(self._acceleration @ (masses @ positions))
