"""Self-collision: vertices of the mesh keep a minimal distance from each other."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from pdrom.model.compiled.functions import compiled
from pdrom.model.effects.base import Contact, EffectConfig
from pdrom.model.mesh.types import MAX_LENGTH, MIN_LENGTH, Mesh

# Largest number of searches for close pairs per frame, and of passes over the pairs per search.
SEARCHES, SWEEPS = 20, 100
# Search radius in thicknesses; above 1, as separating a pair may bring other vertices too close.
REACH = 1.25
# Passes over the pairs end when no pair of vertices is closer than this times the thickness.
ENOUGH = 0.95
# Largest distance of a point of an equilateral triangle with unit edges from its nearest corner.
COVER = 1.0 / np.sqrt(3.0)


class SelfCollision(Contact):
    """Separate vertices closer than the thickness, except pairs that are as close at rest.

    Close pairs (found by a k-d tree) are separated along their connecting line, in proportion to
    their inverse masses (zero for held vertices); momentum is conserved if no vertex is held.
    Passes over the pairs, in the order of their vertices, are repeated until all distances reach
    `ENOUGH` times the thickness; for many pairs in a small region this may take several frames.

    A pair whose connecting line reversed in the frame is moved back. Only vertices collide, but no
    vertex can pass between others if the thickness is above 0.58 edge lengths and no pair
    approaches by more than the thickness in a frame.
    """

    class Config(EffectConfig):
        """``thickness`` in metres: vertices that are closer collide."""

        effect: Literal["self_collision"] = "self_collision"
        thickness: Annotated[float, Field(ge=MIN_LENGTH, le=MAX_LENGTH)]

    in_subspace = False
    each_alone = False

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._thickness = config.thickness
        edges = mesh.points[mesh.edges()]
        self._needed = COVER * np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1).max()

    def doubt(self, rest: np.ndarray, free: np.ndarray) -> str:
        """Return a warning if a vertex can pass between others, with the thickness needed; else "".

        The result depends only on the edges of the rest shape, not on ``rest`` and ``free``.
        """
        if self._thickness >= self._needed:
            return ""
        # round up, so that the thickness in the message is sufficient
        step = 10.0 ** (np.floor(np.log10(self._needed)) - 1.0)
        return (
            f"with thickness {self._thickness:g} a vertex can pass between others; at least "
            f"{np.ceil(self._needed / step) * step:.2g} is needed"
        )

    def correct(self, positions: np.ndarray, before: np.ndarray) -> None:
        self.apply(positions, before, np.empty(0, dtype=np.int64))

    def apply(self, positions: np.ndarray, before: np.ndarray, held: np.ndarray) -> None:
        inverse_masses = 1.0 / self.masses
        inverse_masses[held] = 0.0
        for _ in range(SEARCHES):
            pairs = self._pairs(positions)
            pairs = pairs[inverse_masses[pairs].any(axis=1)]
            closest = _separate(
                positions, before, pairs, inverse_masses, self._thickness, ENOUGH, SWEEPS
            )
            if closest >= ENOUGH * self._thickness:
                return

    def _pairs(self, positions: np.ndarray) -> np.ndarray:
        """Return vertex pairs (n, 2) that are close now but not at rest, in lexicographic order."""
        if not np.isfinite(positions).all():
            return np.empty((0, 2), dtype=np.int64)
        from scipy.spatial import cKDTree

        close = cKDTree(positions).query_pairs(REACH * self._thickness, output_type="ndarray")
        rest = self.mesh.points
        apart = np.linalg.norm(rest[close[:, 0]] - rest[close[:, 1]], axis=1)
        close = close[apart > self._thickness].astype(np.int64)
        return close[np.lexsort((close[:, 1], close[:, 0]))]


@compiled(error_model="python")
def _separate(q, before, pairs, inverse_masses, thickness, enough, sweeps):
    """Separate vertex ``pairs`` to ``thickness``; return the least distance in the first pass."""
    first = thickness
    for sweep in range(sweeps):
        closest = thickness
        for k in range(len(pairs)):
            i, j = pairs[k, 0], pairs[k, 1]
            dx, dy, dz = q[j, 0] - q[i, 0], q[j, 1] - q[i, 1], q[j, 2] - q[i, 2]
            distance = np.sqrt(dx * dx + dy * dy + dz * dz)
            if distance >= thickness:
                continue
            ex = before[j, 0] - before[i, 0]
            ey = before[j, 1] - before[i, 1]
            ez = before[j, 2] - before[i, 2]
            length = np.sqrt(ex * ex + ey * ey + ez * ez)
            gap = thickness - distance
            if length > 0.0 and dx * ex + dy * ey + dz * ez <= 0.0:
                # line i to j is zero or has turned by >= 90 degrees: use that before the frame
                along = (dx * ex + dy * ey + dz * ez) / length
                dx, dy, dz, distance, gap = ex, ey, ez, length, thickness - along
            elif distance == 0.0:
                dx, dy, dz, distance = 0.0, 1.0, 0.0, 1.0
            if thickness - gap < closest:
                closest = thickness - gap
            step = gap / distance / (inverse_masses[i] + inverse_masses[j])
            for axis, d in enumerate((dx, dy, dz)):
                q[i, axis] -= inverse_masses[i] * step * d
                q[j, axis] += inverse_masses[j] * step * d
        if sweep == 0:
            first = closest
        if closest >= enough * thickness:
            break
    return first
