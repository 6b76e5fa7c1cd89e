"""The step loop of projective dynamics, shared by the full-order model and every reduced run.

One frame (Bouaziz et al. 2014, alg. 1): y <- s = q + h v + h^2 a, then K times a local step
p_j = p_j(y) and a global step (M/h^2 + sum S^T W S) y = (M/h^2) s + sum S^T W p; finally
v = (y - q) / h and q = y. What replaces the projections of a group is a `LocalStep`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Protocol

import numpy as np

from pdrom.effects.base import Boundary, Contact, Force
from pdrom.fom.system import GlobalSystem

PHASES = ("inertia", "local", "global", "finish")


class LocalStep(Protocol):
    """Contribution of one group to the right-hand side. A constraint group is one itself."""

    name: str

    def begin_frame(self, q: np.ndarray) -> None:
        """Called once a frame with its first positions (N, 3)."""

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) to ``rhs`` (N, 3); return the energy W(y), nan where it is not known."""


@dataclass(frozen=True)
class State:
    """Positions (N, 3) m and velocities (N, 3) m/s."""

    positions: np.ndarray
    velocities: np.ndarray


@dataclass(frozen=True)
class FrameReport:
    """What a frame did.

    objective : (K,) value of 1/(2 h^2) |M^1/2 (y - s)|^2 + sum_j W_j(y) at the K local iterates;
        empty if it was not tracked
    seconds : (4,) time of each of `PHASES`
    """

    objective: np.ndarray
    seconds: np.ndarray


class Stepper:
    """Advances a state frame by frame.

    Roles that a scene does not fill are empty sequences and cost nothing.
    """

    def __init__(
        self,
        system: GlobalSystem,
        time_step: float,
        iterations: int,
        local_steps: Sequence[LocalStep],
        forces: Sequence[Force] = (),
        boundaries: Sequence[Boundary] = (),
        contacts: Sequence[Contact] = (),
        track_objective: bool = True,
    ) -> None:
        self.system = system
        self.time_step = time_step
        self.iterations = iterations
        self.local_steps = list(local_steps)
        self._forces, self._boundaries, self._contacts = forces, boundaries, contacts
        self._track = track_objective

    def step(
        self,
        state: State,
        frame: int,
        on_last_iterate: Callable[[np.ndarray], None] | None = None,
    ) -> tuple[State, FrameReport]:
        """Do one frame (``frame`` is 0-based); ``on_last_iterate`` sees the last local iterate y."""
        h = self.time_step
        seconds = np.zeros(len(PHASES))
        started = perf_counter()
        s = self._prediction(state)
        fixed, targets = self._fixed(frame, state.positions)
        s[fixed] = targets
        elimination = self.system.eliminate(fixed)
        elimination.set_targets(targets)
        base = self.system.inertia[:, None] * s
        for local in self.local_steps:
            local.begin_frame(state.positions)
        y, rhs = s.copy(), np.empty_like(s)
        objective = np.zeros(self.iterations if self._track else 0)
        seconds[0] = perf_counter() - started
        for k in range(self.iterations):
            if on_last_iterate is not None and k == self.iterations - 1:
                on_last_iterate(y)
            before = perf_counter()
            np.copyto(rhs, base)
            energy = 0.0
            for local in self.local_steps:
                energy += local.accumulate(y, rhs)
            between = perf_counter()
            if self._track:
                objective[k] = energy + self._inertia_energy(y, s)
            tracked = perf_counter()
            elimination.solve(rhs, y)
            seconds[1] += between - before
            seconds[2] += perf_counter() - tracked
        before = perf_counter()
        for contact in self._contacts:
            contact.correct(y)
        velocities = (y - state.positions) / h
        seconds[3] = perf_counter() - before
        return State(y, velocities), FrameReport(objective, seconds)

    def _prediction(self, state: State) -> np.ndarray:
        """Inertial prediction s = q + h v + h^2 M^-1 f_ext."""
        s = state.positions + self.time_step * state.velocities
        for force in self._forces:
            s += self.time_step**2 * force.acceleration(state.positions, state.velocities)
        return s

    def _fixed(self, frame: int, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Vertices held in this frame, ascending, and their positions (n, 3)."""
        held = [b.targets(frame, positions) for b in self._boundaries if b.active(frame)]
        if not held:
            return np.empty(0, dtype=np.int64), np.empty((0, 3))
        vertices, first = np.unique(np.concatenate([v for v, _ in held]), return_index=True)
        return vertices, np.concatenate([t for _, t in held])[first]

    def _inertia_energy(self, y: np.ndarray, s: np.ndarray) -> float:
        difference = y - s
        return 0.5 * float(self.system.inertia @ np.einsum("ij,ij->i", difference, difference))
