"""Whole frames of all vertices in one compiled call, many frames a call.

This serves scenes in which Python has nothing to decide between two frames: forces that are
constant or proportional to the velocity, compiled local steps without frame-lagged data, floors. A
call ends where another set of vertices is held, or where any are taken hold of: their targets are
known only then.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pdrom.model.compiled.clock import now
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import WIDTH, empty, unflat, write, zeros
from pdrom.model.dynamics.acceleration import NO_HISTORY, Anderson, forget
from pdrom.model.dynamics.frames import end, predict, weighted
from pdrom.model.dynamics.iterations import CompiledIterations, all_iterations
from pdrom.model.dynamics.sweeps import load
from pdrom.model.effects.base import Boundary, Contact, Force

# Frames of a call at most, so that a run that ends early has done little for nothing.
BLOCK = 16

Blocks = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Positions and velocities (n, N, 3) after each of n frames, objective (n, K), seconds (n, 4)."""


class WholeFrames:
    """Frames of a step loop in a `pdrom.model.dynamics.space.VertexSpace`.

    Parameters
    ----------
    space : gives ``held_path`` and ``system``
    loop : the compiled iterations
    forces : with a ``rate``
    contacts : with a ``height``
    """

    def __init__(
        self,
        space: Any,
        loop: CompiledIterations,
        forces: Sequence[Force],
        contacts: Sequence[Contact],
        acceleration: Anderson | None,
    ) -> None:
        self._space, self._loop, self._anderson = space, loop, acceleration
        vertices = len(space.system.inertia)
        nothing = np.zeros((vertices, 3))
        constants = [f.acceleration(nothing, nothing) for f in forces]
        self._constants = np.array(
            [np.broadcast_to(own, (vertices, 3)) for own in constants]
        ).reshape(-1, vertices, 3)
        rates = [np.broadcast_to(np.asarray(f.rate, float), vertices) for f in forces]
        self._rates = np.array(rates).reshape(-1, vertices)
        # one row for all vertices where all forces are uniform
        alike = not self._rates.any() and bool((self._constants == self._constants[:, :1]).all())
        self._acceleration = np.zeros((1 if alike else vertices, 3))
        self._floors = np.array([contact.height for contact in contacts], dtype=float)
        self._work = tuple(empty(WIDTH * vertices) for _ in range(2))
        self._first = unflat(zeros(WIDTH * vertices))

    @staticmethod
    def suits(
        steps: Sequence[Any],
        forces: Sequence[Force],
        boundaries: Sequence[Boundary],
        contacts: Sequence[Contact],
    ) -> bool:
        """Whether compiled code can do all local ``steps`` and effects of these roles.

        Stand-ins that watch one of the ``forces``, ``boundaries`` or ``contacts`` cannot be.
        """
        return (
            all(isinstance(force, Force) and force.rate is not None for force in forces)
            and all(isinstance(boundary, Boundary) for boundary in boundaries)
            and all(isinstance(c, Contact) and c.height is not None for c in contacts)
            and not any(getattr(step, "frame_lagged", True) for step in steps)
        )

    def run(
        self, q: np.ndarray, v: np.ndarray, frames: range, h: float, iterations: int, track: bool
    ) -> Blocks | None:
        """Run as many of ``frames`` as one call can do, from q and v (N, 3) with step h (s).

        ``track`` asks for the objectives. None where the iterations take another solver.
        """
        fixed, targets = self._space.held_path(frames[:BLOCK], q)
        system = self._space.system.eliminate(fixed)
        if not self._loop.takes(system):
            return None
        count = len(targets)
        positions, velocities = np.empty((2, count + 1, *q.shape))
        positions[0], velocities[0] = q, v
        objective = np.full((count, iterations if track else 0), np.nan)
        seconds = np.zeros((count, 4))
        history = NO_HISTORY
        if self._anderson is not None:
            self._anderson.begin_frame(self._first)
            history = self._anderson.history
        _frames(
            positions, velocities, self._constants, self._rates, self._acceleration, h, fixed,
            targets, system.coupling, self._floors, self._work, (0, iterations, iterations),
            history, objective, seconds, *self._loop.compiled_arguments, system.factor,
        )  # fmt: skip
        return positions[1:], velocities[1:], objective, seconds


@inner
def _accelerate(constants, rates, velocities, result):
    """Sum of all forces' accelerations, (N, 3), or (1, 3) where they are constant."""
    for i in range(len(result)):
        for axis in range(3):
            total = 0.0
            for k in range(len(constants)):
                # no product with a rate of zero: a velocity that is not finite stays where it is
                own = -rates[k, i] * velocities[i, axis] if rates[k, i] else constants[k, i, axis]
                total += own
            result[i, axis] = total


@inner
def _correct(y, floors, fixed, targets):
    """Lift free vertices onto the floors."""
    for height in floors:
        for i in range(1, len(y), WIDTH):
            if y[i] < height:
                y[i] = height
    for i in range(len(fixed)):
        for axis in range(3):
            y[WIDTH * fixed[i] + axis] = targets[i, axis]


@compiled(nogil=True)
def _frames(
    positions, velocities, constants, rates, acceleration, h, fixed, targets, coupling, floors,
    work, which, history, objective, seconds, inertia, tables, second, watch, factor,
):  # fmt: skip
    y, rhs = work
    beside, indptr, indices, data = coupling
    for f in range(len(targets)):
        began = now(watch)
        _accelerate(constants, rates, velocities[f], acceleration)
        s = predict(positions[f], velocities[f], acceleration, h)
        for i in range(len(fixed)):
            for axis in range(3):
                s[WIDTH * fixed[i] + axis] = targets[f, i, axis]
        load(beside, indptr, indices, data, targets[f], factor[2])
        base = weighted(inertia, s)
        write(s, y)
        if history is not None:
            forget(history)
        seconds[f, 0] = now(watch) - began
        all_iterations(
            which, y, s, base, rhs, inertia, tables, second, factor, history, objective[f],
            seconds[f], watch,
        )  # fmt: skip
        began = now(watch)
        if len(floors):
            _correct(y, floors, fixed, targets[f])
        end(y, positions[f], h, positions[f + 1], velocities[f + 1])
        seconds[f, 3] = now(watch) - began
