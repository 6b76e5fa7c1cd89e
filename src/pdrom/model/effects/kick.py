"""Initial velocities: a uniform one, and a smooth random one for held-out test motions."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from pdrom.model.effects.base import EffectConfig, Seed, Start, Vector
from pdrom.model.mesh.types import Mesh


class Velocity(Start):
    """The same initial velocity of all vertices; held ones follow their targets instead."""

    class Config(EffectConfig):
        """Velocity ``value`` in m/s."""

        effect: Literal["velocity"] = "velocity"
        value: Vector

    def velocity(self) -> np.ndarray:
        return np.array(self.config.value)


class Kick(Start):
    """Random initial velocity: combination of 1, x, y, z, xy, yz, zx with seeded coefficients.

    Coordinates are relative to the mean vertex and to half the longest side. Such polynomials
    excite slow motions of the whole body, without noise at the scale of elements.
    """

    class Config(EffectConfig):
        """``speed`` is the largest vertex speed in m/s; velocities are along ``axes`` only."""

        effect: Literal["kick"] = "kick"
        speed: Annotated[float, Field(gt=0.0, le=1e3, allow_inf_nan=False)]
        seed: Seed
        axes: Annotated[tuple[Literal["x", "y", "z"], ...], Field(min_length=1)] = ("x", "y", "z")

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._points, self._extent = mesh.points, mesh.extent

    def velocity(self) -> np.ndarray:
        x, y, z = ((self._points - self._points.mean(axis=0)) / (0.5 * self._extent)).T
        fields = np.stack([np.ones_like(x), x, y, z, x * y, y * z, z * x], axis=1)
        generator = np.random.default_rng(self.config.seed)
        coefficients = generator.standard_normal((fields.shape[1], 3))
        coefficients[:, ["xyz"[a] not in self.config.axes for a in range(3)]] = 0.0
        velocity = fields @ coefficients
        return velocity * (self.config.speed / np.linalg.norm(velocity, axis=1).max())
