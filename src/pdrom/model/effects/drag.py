"""Viscous drag on the surface."""

from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from pdrom.model.effects.base import EffectConfig, Force
from pdrom.model.mesh.measures import barycentric_areas
from pdrom.model.mesh.types import Mesh


class Drag(Force):
    """Force -c A_v v on each vertex, A_v a third of the area of its triangles at rest.

    Taken over a frame as the exact decay of a free vertex, v exp(-c A_v h / m_v), so that no
    coefficient and no step turns a velocity round. Inside a volume A_v is zero.
    """

    class Config(EffectConfig):
        """``coefficient`` c in N s/m^3: force per area and speed."""

        effect: Literal["drag"] = "drag"
        coefficient: Annotated[float, Field(ge=0.0, le=1e12)]

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        areas = barycentric_areas(mesh.points, mesh.triangles)
        self._rates = config.coefficient * areas / masses

    @cached_property
    def rate(self) -> np.ndarray:  # type: ignore[override]
        """Velocity lost in a frame over its first value and the step, (N,) 1/s."""
        return -np.expm1(-self._rates * self.time_step) / self.time_step

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        return -self.rate[:, None] * velocities
