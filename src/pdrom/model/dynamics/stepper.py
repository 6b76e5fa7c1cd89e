"""The step loop of projective dynamics, shared by the full-order model and every reduced run.

A frame (Bouaziz et al. 2014, alg. 1) begins with the iterate y = s = q + h v + h^2 a (positions q,
velocities v, accelerations a, time step h). Each of K iterations has a local step, the projections
p = p(y) of each constraint group (`LocalStep`), and a global step, which solves
(M/h^2 + sum S^T W S) y = (M/h^2) s + sum S^T W p with masses M and, summed over the groups,
operators S and weights W. The frame ends with v = (y - q) / h and q = y.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol

import numpy as np

from pdrom.model.dynamics.acceleration import Anderson
from pdrom.model.dynamics.space import Solve, Space
from pdrom.model.effects.base import Anchors

PHASES = ("inertia", "local", "global", "finish")
Observer = Callable[[np.ndarray], None] | None
"""Function that is called with the iterate y of the last local step of a frame, or None."""


Vectors = tuple[np.ndarray, np.ndarray, np.ndarray]


class LocalStep(Protocol):
    """Local step of a constraint group, or an approximation of it; groups have these methods, too.

    In a position subspace y and rhs have the shape (k, 3) of k coordinates instead of (N, 3).
    Compiled iterations need an attribute ``local_kernel`` in every local step. A local step that
    several runs may share has a method ``for_run``, which returns a copy with separate memory.
    """

    name: str

    def begin_frame(self, q: np.ndarray) -> None:
        """Prepare a frame that begins at positions ``q`` (N, 3) m; called once per frame."""

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) to ``rhs`` (N, 3), with the projections p of the group.

        Return the energy of the group, J; nan if an approximation does not compute it.
        """


@dataclass(frozen=True)
class State:
    """Positions (N, 3) m and velocities (N, 3) m/s, or their coordinates (k, 3) in a subspace.

    ``anchors`` are positions where holds began; any step loop of the scene needs them to continue.
    """

    positions: np.ndarray
    velocities: np.ndarray
    anchors: Anchors = ()


@dataclass(frozen=True)
class FrameReport:
    """Objective and computation times of a frame with K iterations.

    objective : (K,) J, 1/(2 h^2) |M^1/2 (y - s)|^2 + sum_j W_j(y), energies W_j of the constraint
        groups, at the iterate y of each local step (for one that Anderson acceleration rejects: at
        the last accepted one); nan if an energy is unknown, empty if it was not tracked
    seconds : (4,) time of each of `PHASES`
    """

    objective: np.ndarray
    seconds: np.ndarray


class Stepper:
    """Step loop in the coordinates of a `Space`; it owns all memory that its run writes."""

    def __init__(
        self,
        space: Space,
        time_step: float,
        iterations: int,
        local_steps: Sequence[LocalStep],
        track_objective: bool = True,
        acceleration: Anderson | None = None,
    ) -> None:
        self.space = space
        self.time_step = time_step
        self.iterations = iterations
        own = [s.for_run() if hasattr(s, "for_run") else s for s in local_steps]
        self.local_steps: list[Any] = own
        self._acceleration = acceleration
        self._track = track_objective
        # `WholeFrames` or None; a subclass may set another object that has the same method `run`
        self._whole: Any
        self._compiled, self._whole = space.compiled(self.local_steps, acceleration)

    def local_step(self, name: str) -> Any:
        """Return the local step ``name`` of this loop, with the data of the present frame."""
        return next(step for step in self.local_steps if step.name == name)

    def step(
        self, state: State, frame: int, on_last_iterate: Observer = None
    ) -> tuple[State, FrameReport]:
        """Compute ``frame`` (0-based); call ``on_last_iterate`` with y of the last local step."""
        if on_last_iterate is None:
            for done in self._at_once(state, range(frame, frame + 1)):
                return done
        seconds = np.zeros(len(PHASES))
        started = perf_counter()
        s, elimination, base, anchors = self._begin(state, frame)
        seconds[0] = perf_counter() - started
        y, objective = self._iterate(s, base, elimination, seconds, on_last_iterate)
        before = perf_counter()
        after = self._finish(state, y, frame, anchors)
        seconds[3] = perf_counter() - before
        return after, FrameReport(objective, seconds)

    def run(self, state: State, frames: range) -> Iterator[tuple[State, FrameReport]]:
        """Yield the state and report after each of ``frames``, several of them per compiled call.

        Changes by the caller, for example of an effect, do not affect frames already computed.
        """
        while frames:
            # if a subclass overrides `step`, it is called for every frame
            own = type(self).step is not Stepper.step
            done = () if own else self._at_once(state, frames)
            for after in done or (self.step(state, frames.start),):
                state, frames = after[0], frames[1:]
                yield after

    def _at_once(self, state: State, frames: range) -> Sequence[tuple[State, FrameReport]]:
        """Compute as many of ``frames`` as one compiled call can; return results, () if none."""
        if self._whole is None:
            return ()
        q, v, h = state.positions, state.velocities, self.time_step
        started = perf_counter()
        found = self._whole.run(q, v, frames, h, self.iterations, self._track, state.anchors)
        if found is None:
            return ()
        done, anchors = found
        # time outside compiled code is added to phase "inertia", divided equally among the frames
        beside = perf_counter() - started - float(done[3].sum())
        done[3][:, 0] += max(beside, 0.0) / len(done[3])
        return [
            (State(q, v, anchors), FrameReport(objective, seconds))
            for q, v, objective, seconds in zip(*done, strict=True)
        ]

    def _begin(self, state: State, frame: int) -> tuple[np.ndarray, Solve, np.ndarray, Anchors]:
        """Return prediction s with targets in fixed rows, factored system, (M/h^2) s, anchors."""
        space, h = self.space, self.time_step
        s = space.predict(state.positions, state.velocities, h)
        fixed, targets, anchors = space.fixed(frame, state.positions, state.anchors)
        s[fixed] = targets
        elimination = space.eliminate(fixed, targets)
        base = space.inertia(s)
        for local in self.local_steps:
            local.begin_frame(state.positions)
        return s, elimination, base, anchors

    def _iterate(
        self, s: np.ndarray, base: np.ndarray, system: Solve, seconds: np.ndarray, watch: Observer
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute all iterations of a frame; return the last iterate and the objective (K,), J.

        Iterations begin with the prediction ``s``. Times of local and global steps are added to
        ``seconds``; ``watch`` is called with the iterate before the last iteration.
        """
        y = self.space.copy(s)
        objective = np.full(self.iterations if self._track else 0, np.nan)
        if self._acceleration is not None:
            self._acceleration.begin_frame(y)
        compiled = self._compiled
        k, last = 0, self.iterations - 1
        while k <= last:
            if watch is not None and k == last:
                watch(y)
            if compiled is None or not compiled.takes(system):
                self._in_python(k, (s, base, y), system, objective, seconds)
                k += 1
                continue
            end = last if watch is not None and k < last else self.iterations
            which = range(k, end)
            compiled.run(which, self.iterations, objective, y, s, base, system, seconds)
            k = end
        return y, objective

    def _in_python(
        self, k: int, vectors: Vectors, system: Solve, objective: np.ndarray, seconds: np.ndarray
    ) -> None:
        """Compute iteration k without compiled code; update y, objective and seconds in place.

        ``vectors`` are the prediction s of the frame, (M/h^2) s and the iterate y.
        """
        s, base, y = vectors
        space, acceleration = self.space, self._acceleration
        before = perf_counter()
        rhs = space.copy(base)
        energy = 0.0
        for local in self.local_steps:
            energy += local.accumulate(y, rhs)
        between = perf_counter()
        seconds[1] += between - before
        if self._track and energy == energy:
            objective[k] = energy + space.inertia_energy(y - s)
        before = perf_counter()
        if acceleration is None:
            system.solve(rhs, y)
        elif acceleration.refuse(y, energy + space.inertia_energy(y - s)):
            objective[k : k + 1] = objective[k - 1 : k]
        else:
            system.solve(rhs, y)
            # the last solution is not combined with earlier ones, as this could raise the objective
            if k < self.iterations - 1:
                acceleration.combine(y)
        seconds[2] += perf_counter() - before

    def _finish(self, state: State, y: np.ndarray, frame: int, anchors: Anchors) -> State:
        """Return the state after the frame: apply contacts, then compute the velocities."""
        self.space.correct(y, state.positions, frame)
        return State(*self.space.end(y, state.positions, self.time_step), anchors)
