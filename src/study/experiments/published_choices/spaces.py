"""Holding vertices, and letting them meet the floor, as the published code does."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pdrom.model.dynamics.acceleration import Anderson
from pdrom.model.dynamics.iterations import CompiledIterations
from pdrom.model.dynamics.space import Solve, VertexSpace
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.effects.floor import Floor
from pdrom.model.scene import Scene

HEAVY = 1e10  # kg


class PublishedSpace(VertexSpace):
    """Vertex positions with the published code's floor, its pins, or both.

    floor_first : the floor lifts the inertial prediction, before the iterations instead of after
    heavy : pinned vertices are not eliminated, they get a mass of 1e10 kg
    """

    def __init__(self, scene: Scene, floor_first: bool, heavy: bool) -> None:
        floors = [contact for contact in scene.contacts if isinstance(contact, Floor)]
        others = [contact for contact in scene.contacts if not isinstance(contact, Floor)]
        contacts = others if floor_first else scene.contacts
        super().__init__(scene.system, scene.forces, scene.boundaries, contacts)
        heights = [floor.config.height for floor in floors if floor_first]
        self._height = max(heights, default=-np.inf)
        self._scene, self._heavy = scene, heavy
        self._systems: dict[bytes, GlobalSystem] = {}
        self._unforced = np.empty((0, 3))

    def predict(self, positions: np.ndarray, velocities: np.ndarray, h: float) -> np.ndarray:
        self._unforced = positions + h * velocities
        s = super().predict(positions, velocities, h)
        np.maximum(s[:, 1], self._height, out=s[:, 1])
        return s

    def fixed(self, frame: int, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Heavy vertices of ``positions`` (N, 3) m go on as they move: no force reaches them."""
        held, targets = super().fixed(frame, positions)
        if not self._heavy:
            return held, targets
        self.system = self._system(held)
        return held, self._unforced[held]

    def eliminate(self, fixed: np.ndarray, targets: np.ndarray) -> Solve:
        return super().eliminate(*((fixed[:0], targets[:0]) if self._heavy else (fixed, targets)))

    def compiled(
        self, local_steps: Sequence[Any], acceleration: Anderson | None = None
    ) -> CompiledIterations | None:
        """None with heavy vertices: compiled iterations know one mass matrix."""
        return None if self._heavy else super().compiled(local_steps, acceleration)

    def _system(self, held: np.ndarray) -> GlobalSystem:
        """The system with the mass of the ``held`` vertices, built once."""
        key = held.tobytes()
        if key not in self._systems:
            masses = self._scene.masses.copy()
            masses[held] = HEAVY
            config = self._scene.config
            self._systems[key] = GlobalSystem(masses, config.time_step, self._scene.groups)
        return self._systems[key]
