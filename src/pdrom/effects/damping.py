"""Viscous drag of the surrounding medium."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from pdrom.effects.base import EffectConfig, Force
from pdrom.mesh.types import Mesh


class Damping(Force):
    """Acceleration -c v, explicit in the velocity of the frame's beginning."""

    class Config(EffectConfig):
        """``rate`` c in 1/s; the explicit treatment is stable for c h < 2."""

        effect: Literal["damping"] = "damping"
        rate: Annotated[float, Field(ge=0.0, le=1e3, allow_inf_nan=False)]

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        return -self.config.rate * velocities
