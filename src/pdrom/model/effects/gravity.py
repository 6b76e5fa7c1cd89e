"""Uniform acceleration."""

from typing import Literal

import numpy as np

from pdrom.model.effects.base import EffectConfig, Force, Vector
from pdrom.model.mesh.types import Mesh


class Gravity(Force):
    """An equal acceleration for every vertex."""

    class Config(EffectConfig):
        """``acceleration`` in m/s^2."""

        effect: Literal["gravity"] = "gravity"
        acceleration: Vector = (0.0, -9.81, 0.0)

    rate = 0.0

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._acceleration = np.array(config.acceleration)

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        return self._acceleration

    def potential(self, positions: np.ndarray, masses: np.ndarray) -> float:
        return -float(self._acceleration @ (masses @ positions))
