"""Coordinates of the step loop: vertex positions, or coordinates in a position subspace."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from pdrom.model.compiled.rows import copied, flat, unflat
from pdrom.model.dynamics.acceleration import Anderson
from pdrom.model.dynamics.frames import CompiledIterations, WholeFrames, end, predict, weighted
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.effects import base


class Solve(Protocol):
    """A factored global system from which coordinates with prescribed values are eliminated."""

    def set_targets(self, targets: np.ndarray) -> None:
        """Set the values ``targets`` (m, 3) of the prescribed coordinates for the next solves."""

    def solve(self, rhs: np.ndarray, y: np.ndarray) -> None:
        """Overwrite the free coordinates of ``y`` (n, 3) by the solution for ``rhs`` (n, 3)."""


class Space(ABC):
    """Interface of the step loop to its unknowns (coordinates).

    Arrays are (n, 3) for n coordinates: ``positions`` and their ``velocities`` at the beginning of
    a frame, the iterate ``y``, the prediction ``s``. ``h`` is the time step in seconds.
    """

    boundaries: Sequence[Any]  # each acts like a `base.Boundary`, on coordinates
    _eliminated: Callable[[np.ndarray], Solve]
    _made: dict[bytes, Solve]

    def predict(self, positions: np.ndarray, velocities: np.ndarray, h: float) -> np.ndarray:
        """Return the prediction s = q + h v + h^2 a of ``positions`` q and ``velocities`` v."""
        return positions + h * velocities + h**2 * self.acceleration(positions, velocities)

    def copy(self, s: np.ndarray) -> np.ndarray:
        """Return a copy of ``s`` (n, 3), a result of `predict` or `inertia`."""
        return s.copy()

    def end(self, y: np.ndarray, before: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates (last iterate ``y``) and velocities; ``before``: old coordinates."""
        return y, (y - before) / h

    def compiled(
        self, local_steps: Sequence[Any], acceleration: Anderson | None = None
    ) -> tuple[CompiledIterations | None, WholeFrames | None]:
        """Return compiled loops over a frame's iterations and over frames, with ``acceleration``.

        A loop that does not exist for these coordinates or for ``local_steps`` is None.
        """
        return None, None

    @abstractmethod
    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        """Return the acceleration by all forces, m/s^2, of a shape that broadcasts to (n, 3).

        ``positions`` (m) and ``velocities`` (m/s) are those at the beginning of the frame.
        """

    def fixed(self, frame: int, positions: np.ndarray, anchors: base.Anchors = ()) -> base.Held:
        """Return indices (m,), ascending, and values (m, 3) of coordinates prescribed in ``frame``.

        ``positions`` (n, 3) are the coordinates at the beginning of the frame, ``anchors`` belong
        to this state; the third result are the anchors of the state after the frame.
        """
        one = range(frame, frame + 1)
        indices, path, anchors = base.held_path(self.boundaries, one, positions, anchors)
        return indices, path[0], anchors

    def held_path(
        self, frames: range, positions: np.ndarray, anchors: base.Anchors = ()
    ) -> base.Held:
        """Return indices (m,) and values (n, m, 3) in the first n ``frames``, else as `fixed`.

        Holds begin or end only in the first of these frames.
        """
        return base.held_path(self.boundaries, frames, positions, anchors)

    def elimination(self, fixed: np.ndarray) -> Any:
        """Return the factored system (`Solve`) without ``fixed`` coordinates, made only once."""
        key = fixed.tobytes()
        if key not in self._made:
            self._made[key] = self._eliminated(fixed)
        return self._made[key]

    def eliminate(self, fixed: np.ndarray, targets: np.ndarray) -> Solve:
        """Return the factored system in which ``fixed`` coordinates have the values ``targets``."""
        elimination: Solve = self.elimination(fixed)
        elimination.set_targets(targets)
        return elimination

    @abstractmethod
    def inertia(self, s: np.ndarray) -> np.ndarray:
        """Return (M / h^2) s for a prediction ``s`` (n, 3)."""

    @abstractmethod
    def inertia_energy(self, difference: np.ndarray) -> float:
        """Return 1/(2 h^2) |M^1/2 difference|^2, J; ``difference`` (n, 3): y minus prediction s."""

    @abstractmethod
    def correct(self, y: np.ndarray, before: np.ndarray, frame: int) -> None:
        """Apply contacts to ``y`` at the end of ``frame``; ``before``: coordinates at its start."""


class VertexSpace(Space):
    """Vertex positions as coordinates, with forces, boundaries and contacts of a scene."""

    def __init__(
        self,
        system: GlobalSystem,
        forces: Sequence[base.Force] = (),
        boundaries: Sequence[base.Boundary] = (),
        contacts: Sequence[base.Contact] = (),
    ) -> None:
        self.system, self._eliminated, self._made = system, system.eliminate, {}
        self._forces, self.boundaries, self._contacts = forces, boundaries, contacts

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        total = np.zeros(3)
        for force in self._forces:
            total = total + force.acceleration(positions, velocities)
        return total

    def predict(self, positions: np.ndarray, velocities: np.ndarray, h: float) -> np.ndarray:
        acceleration = np.atleast_2d(self.acceleration(positions, velocities))
        return unflat(predict(positions, velocities, acceleration, h))

    def copy(self, s: np.ndarray) -> np.ndarray:
        return unflat(copied(flat(s)))

    def end(self, y: np.ndarray, before: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        positions, velocities = np.empty_like(before), np.empty_like(before)
        end(flat(y), before, h, positions, velocities)
        return positions, velocities

    def compiled(
        self, local_steps: Sequence[Any], acceleration: Anderson | None = None
    ) -> tuple[CompiledIterations | None, WholeFrames | None]:
        if any(getattr(step, "local_kernel", None) is None for step in local_steps):
            return None, None
        loop = CompiledIterations(local_steps, self.system.inertia, acceleration)
        effects = self._forces, self.boundaries, self._contacts
        # whole frames are not compiled for subclasses, which may override any part of a frame
        if type(self) is not VertexSpace or not WholeFrames.suits(local_steps, *effects):
            return loop, None
        return loop, WholeFrames(self, loop, self._forces, self._contacts, acceleration)

    def inertia(self, s: np.ndarray) -> np.ndarray:
        return unflat(weighted(self.system.inertia, flat(s)))

    def inertia_energy(self, difference: np.ndarray) -> float:
        squares = np.einsum("ij,ij->i", difference, difference)
        return 0.5 * float(self.system.inertia @ squares)

    def correct(self, y: np.ndarray, before: np.ndarray, frame: int) -> None:
        if not self._contacts:
            return
        held = base.held_vertices(self.boundaries, frame)
        for contact in self._contacts:
            contact.apply(y, before, held)
