"""Compiled frames of the full-order step loop: start, iterations, end; several frames per call.

The iterate ``y`` and the prediction ``s`` are flat arrays of rows of four numbers (x, y, z, 0).
``inertia`` (N,) is M/h^2 in kg/s^2, ``time_step`` is h in s.

If local steps and solver are compiled, one compiled loop runs the iterations of a frame. One call
runs several whole frames in scenes that need no Python code between two frames: forces are
constant or proportional to the velocity, local steps are compiled and prepare no data of a frame,
and all contacts are floors. A call ends before a later frame in which the set of held (prescribed)
vertices changes or a hold begins, because the targets of the vertices are known only then."""

from collections.abc import Sequence
from typing import Any, TypeGuard

import numpy as np

from pdrom.model.compiled import rows
from pdrom.model.compiled.functions import clock, compiled, inner, now
from pdrom.model.compiled.rows import WIDTH, empty, unflat, write, zeros
from pdrom.model.constraints.local_kernel import add_all, table_of
from pdrom.model.dynamics.acceleration import NO_HISTORY, Anderson, combine, forget, refuse
from pdrom.model.dynamics.sweeps import load, sweep
from pdrom.model.dynamics.system import Elimination
from pdrom.model.effects.base import Anchors, Boundary, Contact, Force


@compiled(nogil=True)
def predict(positions, velocities, acceleration, time_step):
    """Return q + h v + h^2 a (h: ``time_step``) as a flat array: x, y, z and 0 for each vertex.

    ``positions`` q and ``velocities`` v are (N, 3), ``acceleration`` a is (N, 3) or (1, 3).
    """
    s, square = np.empty(WIDTH * len(positions)), time_step**2
    for i in range(len(positions)):
        own = i if len(acceleration) > 1 else 0
        for axis in range(3):
            moved = positions[i, axis] + time_step * velocities[i, axis]
            s[WIDTH * i + axis] = moved + square * acceleration[own, axis]
        s[WIDTH * i + 3] = 0.0
    return s


@compiled(nogil=True)
def weighted(inertia, s):
    """Return (M/h^2) s; ``s`` and the result are flat arrays of rows of four numbers."""
    result = np.empty(len(s))
    for i in range(len(inertia)):
        for lane in range(WIDTH):
            result[WIDTH * i + lane] = inertia[i] * s[WIDTH * i + lane]
    return result


@compiled(nogil=True)
def end(y, before, time_step, positions, velocities):
    """Write ``positions`` and ``velocities`` (N, 3) at the end of a frame.

    ``y`` is the last iterate, ``before`` (N, 3) are the positions at the beginning of the frame.
    """
    for i in range(len(before)):
        for axis in range(3):
            positions[i, axis] = y[WIDTH * i + axis]
            velocities[i, axis] = (positions[i, axis] - before[i, axis]) / time_step


@inner
def inertia_energy(y, s, inertia):
    """Return 1/2 |(M/h^2)^1/2 (y - s)|^2 in J; ``inertia`` is M/h^2 (N,)."""
    energy = 0.0
    for i in range(len(inertia)):
        square = 0.0
        for axis in range(3):
            square += (y[WIDTH * i + axis] - s[WIDTH * i + axis]) ** 2
        energy += inertia[i] * square
    return 0.5 * energy


class CompiledIterations:
    """Compiled iterations of a step loop in which every local step has a local kernel.

    local_steps : objects with an attribute ``local_kernel``
    inertia : (N,) M / h^2
    acceleration : Anderson acceleration; the step loop calls its ``begin_frame`` in each frame
    compiled_arguments : those arguments of `all_iterations` that are equal in all frames
    """

    def __init__(
        self, local_steps: Sequence[Any], inertia: np.ndarray, acceleration: Anderson | None = None
    ) -> None:
        self._kernels = [step.local_kernel for step in local_steps]
        self._acceleration = acceleration
        self.compiled_arguments = inertia, table_of(self._kernels), clock()

    def takes(self, elimination: object) -> TypeGuard[Elimination]:
        """Return whether ``elimination`` is a factored system that compiled code can solve."""
        return isinstance(elimination, Elimination) and elimination.factor is not None

    def run(
        self,
        which: range,
        iterations: int,
        objective: np.ndarray,
        y: np.ndarray,
        s: np.ndarray,
        base: np.ndarray,
        elimination: Elimination,
        seconds: np.ndarray,
    ) -> None:
        """Compute iterations ``which`` of the K = ``iterations`` of a frame; change ``y`` in place.

        objective : (K,) receives the objective at the iterates, J; empty if it is not tracked
        y, s, base : iterate, prediction and (M/h^2) s, (N, 3) views of arrays with a fourth column
        elimination : the factored system, one for which `takes` returns True
        seconds : (4,) s; the times of local and global steps are added to entries 1 and 2
        """
        history = NO_HISTORY if self._acceleration is None else self._acceleration.history
        tracked = len(objective) > 0 or history is not None
        right = rows.empty(WIDTH * len(y))
        iterate, start = rows.flat(y), rows.flat(base)
        prediction = rows.flat(s) if tracked else start
        inertia, table, watch = self.compiled_arguments
        all_iterations(
            (which.start, which.stop, iterations), iterate, prediction, start, right,
            inertia, table, elimination.factor, history, objective, seconds, watch,
        )  # fmt: skip


@compiled(nogil=True)
def all_iterations(
    which, y, s, base, rhs, inertia, table, factor, history, objective, seconds, watch
):
    """Compute iterations of a frame in place, see `CompiledIterations.run`.

    which : (first, end, K): compute iterations first, ..., end - 1 of the K iterations of a frame
    y, s, base, rhs : iterate, prediction, (M/h^2) s, working array; flat rows of four numbers
    inertia : (N,) M/h^2, kg/s^2
    table : local kernels of all local steps, from `pdrom.model.constraints.local_kernel.table_of`
    factor : triangular factor of the global system (`pdrom.model.dynamics.solvers.Factor`)
    history : history of the acceleration; with `NO_HISTORY` its code is not compiled
    objective, seconds : arrays that receive results, as in `CompiledIterations.run`
    watch : buffer for the clock, from `pdrom.model.compiled.functions.clock`
    """
    first, end, iterations = which
    panels, vertices, loads, work = factor
    for k in range(first, end):
        before = now(watch)
        write(base, rhs)
        energy = add_all(table, y, rhs)
        between = now(watch)
        seconds[1] += between - before
        value = np.nan
        refused = False
        if len(objective):
            value = objective[k] = energy + inertia_energy(y, s, inertia)
            between = now(watch)
        if history is not None:
            if not len(objective):
                value = energy + inertia_energy(y, s, inertia)
            refused = refuse(history, y, value)
        if refused:
            if len(objective):
                objective[k] = objective[k - 1]
        else:
            sweep(panels, vertices, loads, work, rhs, y)
            # the last iteration is not accelerated, so that it cannot raise the objective
            if history is not None and k < iterations - 1:
                combine(history, y)
        seconds[2] += now(watch) - between
    return 0.0


# Largest number of frames per compiled call; small, so that few are wasted if a run ends early.
BLOCK = 16

Blocks = tuple[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray], Anchors]
"""Positions, velocities (n, N, 3) at the end of n frames, objectives (n, K), seconds (n, 4); and
the anchors of the states (`pdrom.model.dynamics.stepper.State`)."""


class WholeFrames:
    """Several whole frames per compiled call, for a `pdrom.model.dynamics.space.VertexSpace`.

    space : space whose ``held_path`` and ``elimination`` are used
    loop : compiled iterations that are run in each frame
    forces, contacts : of the scene; no ``rate`` of a force is None, and each contact is a floor
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
        # if all forces are uniform, one row of accelerations serves all vertices
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
        """Return whether compiled code supports all local ``steps`` and effects of a scene.

        Objects that wrap ``forces``, ``boundaries`` or ``contacts`` are not supported.
        """
        return (
            all(isinstance(force, Force) and force.rate is not None for force in forces)
            and all(isinstance(boundary, Boundary) for boundary in boundaries)
            and all(isinstance(c, Contact) and c.height is not None for c in contacts)
            and not any(getattr(step, "frame_lagged", True) for step in steps)
        )

    def run(
        self, q: np.ndarray, v: np.ndarray, frames: range, h: float, iterations: int, track: bool,
        anchors: Anchors,
    ) -> Blocks | None:  # fmt: skip
        """Run the first n ``frames``, as many as one call can, and return the results; return None,
        without a run, if the solver is not compiled.

        q, v : (N, 3) positions, m, and velocities, m/s, at the beginning of the first frame
        h : time step, s
        iterations : number of iterations per frame
        track : whether the objective is computed
        anchors : anchors of the state at the beginning
        """
        fixed, targets, anchors = self._space.held_path(frames[:BLOCK], q, anchors)
        system = self._space.elimination(fixed)
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
        return (positions[1:], velocities[1:], objective, seconds), anchors


@inner
def _accelerate(constants, rates, velocities, result):
    """Write the acceleration by all forces to ``result``: (N, 3), or (1, 3) if it is uniform."""
    for i in range(len(result)):
        for axis in range(3):
            total = 0.0
            for k in range(len(constants)):
                # if the rate is zero, do not multiply: 0 times an infinite velocity would be nan
                own = -rates[k, i] * velocities[i, axis] if rates[k, i] else constants[k, i, axis]
                total += own
            result[i, axis] = total


@inner
def _correct(y, floors, fixed, targets):
    """Lift vertices below a floor onto it, then set the ``fixed`` vertices to their targets."""
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
    work, which, history, objective, seconds, inertia, table, watch, factor,
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
            which, y, s, base, rhs, inertia, table, factor, history, objective[f], seconds[f], watch
        )  # fmt: skip
        began = now(watch)
        if len(floors):
            _correct(y, floors, fixed, targets[f])
        end(y, positions[f], h, positions[f + 1], velocities[f + 1])
        seconds[f, 3] = now(watch) - began
