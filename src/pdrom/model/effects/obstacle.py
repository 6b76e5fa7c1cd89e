"""Base of plane, sphere and box: vertices stop at a convex body, with Coulomb friction."""

from abc import abstractmethod
from typing import Annotated

import numpy as np
from pydantic import Field

from pdrom.model.effects.base import Contact, EffectConfig
from pdrom.model.mesh.types import Mesh

# A vertex that began a frame no deeper than this part of the extent began it outside.
SLACK = 1e-9


class ObstacleConfig(EffectConfig):
    """``friction`` mu: 0 glides, ``.inf`` sticks."""

    friction: Annotated[float, Field(ge=0.0)] = 0.0


class Obstacle(Contact):
    """A convex body that does not move; vertices, not edges or triangles, are kept out of it.

    A vertex whose path of the frame enters the body goes on in the tangent plane at the point of
    entry, also if the path leaves the body again: no step is too large. A vertex that began the
    frame inside goes to the nearest point of the surface. Either is moved by some depth d along the
    normal; its tangential motion along the surface is shortened by mu d, at most to nothing, which
    is Coulomb's law for the impulses m d / h of the frame. Impacts are inelastic.
    """

    def __init__(self, config: ObstacleConfig, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._slack = SLACK * mesh.extent

    def gaps(self, points: np.ndarray) -> np.ndarray:
        return -self.depths(points)

    def correct(self, positions: np.ndarray, before: np.ndarray) -> None:
        outside = self.depths(before) <= self._slack
        hits, entries, normals = self.entries(before, positions)
        hits &= outside
        if hits.any():
            base, n = entries[hits], normals[hits]
            left = positions[hits] - base
            depth = -np.einsum("ij,ij->i", left, n)
            along = left + depth[:, None] * n
            positions[hits] = base + self._braked(along, depth)
        depths = self.depths(positions)
        inside = np.flatnonzero(~hits & (depths > 0.0))
        if len(inside):
            n, depth = self.normals(positions[inside]), depths[inside]
            lifted = positions[inside] + depth[:, None] * n
            moved = lifted - before[inside]
            along = moved - np.einsum("ij,ij->i", moved, n)[:, None] * n
            positions[inside] = lifted - along + self._braked(along, depth)

    def _braked(self, along: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Tangential motion (n, 3) after friction."""
        mu = self.config.friction
        if mu == 0.0:
            return along
        length = np.linalg.norm(along, axis=1)
        most = np.where(depth > 0.0, mu, 0.0) * np.maximum(depth, np.finfo(float).tiny)
        left = np.maximum(length - most, 0.0) / np.where(length > 0.0, length, 1.0)
        return left[:, None] * along

    @abstractmethod
    def depths(self, points: np.ndarray) -> np.ndarray:
        """Distance (n,) of ``points`` (n, 3) m inside to the surface; not positive outside."""

    @abstractmethod
    def normals(self, points: np.ndarray) -> np.ndarray:
        """Outward unit normals (n, 3) at the surface points nearest to ``points`` (n, 3) inside."""

    @abstractmethod
    def entries(
        self, start: np.ndarray, end: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Entry of straight paths from ``start`` to ``end`` (n, 3), begun outside, into the body.

        Returns
        -------
        hits (n,) bool, points (n, 3) m, outward unit normals (n, 3); the latter two mean nothing
        for a path that does not enter.
        """
