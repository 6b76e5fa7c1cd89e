"""Viscous drag of the surrounding medium."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from pdrom.model.effects.base import EffectConfig, Force
from pdrom.model.mesh.types import Mesh


class Damping(Force):
    """Acceleration -c v, explicit in the velocity of the frame's beginning."""

    class Config(EffectConfig):
        """``rate`` c in 1/s; the explicit treatment needs c h < 2, another step is refused."""

        effect: Literal["damping"] = "damping"
        rate: Annotated[float, Field(ge=0.0, le=1e3, allow_inf_nan=False)]

        def check_step(self, time_step: float) -> None:
            if self.rate * time_step >= 2.0:
                raise ValueError(
                    f"damping.rate = {self.rate:g}: unstable with time_step = {time_step:g}, "
                    f"allowed are rates below {2.0 / time_step:g}"
                )

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.rate = config.rate

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        return -self.config.rate * velocities
