"""Forces on vertices (gravity, damping, drag on the surface, wind), and initial velocities."""

from collections.abc import Sequence
from functools import cached_property
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field

from pdrom.model.effects.base import EffectConfig, Force, Seed, Start, Vector
from pdrom.model.mesh.types import Mesh, barycentric_areas


class Gravity(Force):
    """A uniform acceleration of all vertices."""

    class Config(EffectConfig):
        """``acceleration`` in m/s^2."""

        effect: Literal["gravity"] = "gravity"
        acceleration: Vector = (0.0, -9.81, 0.0)

        def tilted(self, degrees: float, axes: Sequence[int], place: int) -> Self:
            own = np.array(self.acceleration)
            size = float(np.linalg.norm(own))
            free = [axis for axis in axes if abs(own[axis]) < size]
            if not free:  # gravity is zero, or parallel to each of ``axes``
                return self
            axis = free[place]
            side = size * np.eye(3)[axis] - own[axis] / size * own
            side *= size / np.linalg.norm(side)
            angle = np.radians(degrees)
            turned = np.cos(angle) * own + np.sin(angle) * side
            return self.model_copy(update={"acceleration": tuple(map(float, turned))})

    rate = 0.0

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        return np.array(self.config.acceleration)

    def potential(self, positions: np.ndarray, masses: np.ndarray) -> float:
        return -float(self.config.acceleration @ (masses @ positions))


class Damping(Force):
    """Acceleration -c v, with the velocity v at the beginning of the frame (explicit)."""

    class Config(EffectConfig):
        """Damping ``rate`` c in 1/s; c is refused unless c h < 2 (stability with time step h)."""

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


class Drag(Force):
    """Force -c A_v v on a vertex with velocity v; A_v is a third of the rest area around it.

    In a frame the velocity of a free vertex of mass m_v decays exactly, to v exp(-c A_v h / m_v),
    so that it never changes its sign. Interior vertices of a volume have A_v = 0.
    """

    class Config(EffectConfig):
        """``coefficient`` c in N s/m^3: force divided by area and speed."""

        effect: Literal["drag"] = "drag"
        coefficient: Annotated[float, Field(ge=0.0, le=1e12)]

    @cached_property
    def rate(self) -> np.ndarray:  # type: ignore[override]
        """Relative loss of velocity in a frame, divided by the time step, (N,) 1/s."""
        areas = barycentric_areas(self.mesh.points, self.mesh.triangles)
        rates = self.config.coefficient * areas / self.masses
        return -np.expm1(-rates * self.time_step) / self.time_step

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        return -self.rate[:, None] * velocities


class Wind(Force):
    """Force 1/2 rho C A |w_n| w_n n on each triangle, divided equally among its corners.

    n is the triangle's normal and A its area, both at the beginning of the frame. w_n is the normal
    component of the wind velocity minus the triangle's mean velocity; a triangle parallel to the
    wind has no force.

    As an explicit step would overshoot in strong wind, the force is divided by 1 + h kappa |w_n|.
    kappa is the largest rho C A_v / (2 m_v) of the corners, and A_v a third of the area around a
    vertex. A free flat sheet with equal A_v / m_v gets its exact velocity. In general, velocities
    relative to the wind are multiplied by a matrix that is symmetric in the inner product of the
    masses, with eigenvalues from 0 to 1: their energy never grows, for any wind, step and masses.
    """

    class Config(EffectConfig):
        """Wind ``velocity`` in m/s, air ``density`` rho in kg/m^3, ``coefficient`` C (no unit)."""

        effect: Literal["wind"] = "wind"
        velocity: Vector
        density: Annotated[float, Field(ge=0.0, le=1e6)] = 1.2
        coefficient: Annotated[float, Field(ge=0.0, le=1e3)] = 1.0

    in_subspace = False

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        triangles = self.mesh.triangles
        corners = positions[triangles]
        vector = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(vector, axis=1)
        normal = vector / np.where(area > 0.0, area, 1.0)[:, None]
        relative = self.config.velocity - velocities[triangles].mean(axis=1)
        speed = np.einsum("ij,ij->i", relative, normal)
        half_density = 0.5 * self.config.density * self.config.coefficient
        kappa = half_density * self._at_vertices(area / 3.0) / self.masses
        slowing = 1.0 + self.time_step * kappa[triangles].max(axis=1) * np.abs(speed)
        force = (half_density * np.abs(speed) * speed / slowing)[:, None] * vector
        shares = np.stack([self._at_vertices(f / 3.0) for f in force.T], axis=1)
        return shares / self.masses[:, None]

    def _at_vertices(self, values: np.ndarray) -> np.ndarray:
        """Return sums (N,) of ``values`` (T,) over the triangles around each vertex."""
        corners = np.repeat(values, 3)
        return np.bincount(self.mesh.triangles.ravel(), corners, minlength=self.mesh.vertices)


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

    Coordinates are relative to the mean vertex and to half the longest side. These polynomials
    excite slow motions of the whole body, without noise at the scale of elements.
    """

    class Config(EffectConfig):
        """``speed`` is the largest vertex speed in m/s; velocities are along ``axes`` only."""

        effect: Literal["kick"] = "kick"
        speed: Annotated[float, Field(gt=0.0, le=1e3, allow_inf_nan=False)]
        seed: Seed
        axes: Annotated[tuple[Literal["x", "y", "z"], ...], Field(min_length=1)] = ("x", "y", "z")

    def velocity(self) -> np.ndarray:
        points, half = self.mesh.points, 0.5 * self.mesh.extent
        x, y, z = ((points - points.mean(axis=0)) / half).T
        fields = np.stack([np.ones_like(x), x, y, z, x * y, y * z, z * x], axis=1)
        generator = np.random.default_rng(self.config.seed)
        coefficients = generator.standard_normal((fields.shape[1], 3))
        coefficients[:, ["xyz"[a] not in self.config.axes for a in range(3)]] = 0.0
        velocity = fields @ coefficients
        return velocity * (self.config.speed / np.linalg.norm(velocity, axis=1).max())
