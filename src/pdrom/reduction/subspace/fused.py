"""Iterations and frames of a subspace model in one compiled loop over the sampled elements.

In the K' coordinates z of a position subspace that are not fixed, one iteration is

    d = D z + d_0        S q of the m sampled elements, d_0 from the fixed coordinates
    p = p(d)             projections
    z = c + L^T p        global step, with c = A^-1 (M/h^2 s - load) and L = W D A^-1

D and L are (m p, K') for p rows per element, load is due to the fixed coordinates. No array grows
with the mesh. If no group has data that are computed once per frame, one compiled call computes
many frames, up to the first in which a vertex is below a floor.
"""

from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np

from pdrom.core.errors import NotReducibleError
from pdrom.model.compiled.functions import clock, compiled, inner, now
from pdrom.model.compiled.rows import write as copy
from pdrom.model.dynamics.acceleration import NO_HISTORY, Anderson, History, combine, forget, refuse
from pdrom.model.dynamics.frames import BLOCK, Blocks
from pdrom.model.dynamics.space import Solve
from pdrom.model.dynamics.stepper import LocalStep, Observer, Stepper
from pdrom.model.effects.base import Anchors
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.interpolation import SubspaceLocalStep
from pdrom.reduction.subspace.newton import CONVERGED, UNNOTICED, newton_arrays, run_newton
from pdrom.reduction.subspace.products import blocks, objective, product, project, vectors
from pdrom.reduction.subspace.space import DenseElimination, ReducedSpace


class FusedStepper(Stepper):
    """Step loop with compiled, fused iterations, whose time counts as that of the local step.

    It iterates like `Stepper` if a local step is no `SubspaceLocalStep` or lacks a gradient kernel.
    """

    def __init__(
        self, scene: Scene, space: ReducedSpace, local_steps: Sequence[LocalStep], newton: bool
    ) -> None:
        config, acceleration = scene.config, None if newton else scene.acceleration()
        h, iterations = config.time_step, config.count
        super().__init__(space, h, iterations, local_steps, False, acceleration)
        self._fused: _Fused | None = None
        steps = [step for step in self.local_steps if isinstance(step, SubspaceLocalStep)]
        kernels = [step.group.gradient_kernel for step in steps]
        if len(steps) == len(local_steps) and None not in kernels:
            self._fused = _Fused(space, _Sampled(steps), acceleration)
            if newton:
                enough = min(CONVERGED * scene.mesh.extent, UNNOTICED * h**2)
                self._fused.enough = scene.masses.sum() * (enough / h) ** 2
            if space.whole_frames and not any(step.group.frame_lagged for step in steps):
                self._whole = self._fused
        elif newton:
            raise NotReducibleError("Newton's method needs sampled elements with gradient kernels")

    def _iterate(
        self, s: np.ndarray, base: np.ndarray, system: Solve, seconds: np.ndarray, watch: Observer
    ) -> tuple[np.ndarray, np.ndarray]:
        plain = self._fused is None or (watch is not None and self._fused.enough is None)
        if self._fused is None or plain or not isinstance(system, DenseElimination):
            return super()._iterate(s, base, system, seconds, watch)
        before = perf_counter()
        y = self._fused.iterate(system, s, base, self.iterations)
        seconds[1] += perf_counter() - before
        if watch is not None:
            watch(y)
        return y, np.empty(0)


class _Fused:
    """Compiled code for iterations and frames, with matrices per set of prescribed coordinates."""

    def __init__(
        self, space: ReducedSpace, sampled: "_Sampled", acceleration: Anderson | None
    ) -> None:
        self._space, self._sampled, self._acceleration = space, sampled, acceleration
        self.enough: float | None = None  # argument of `newton_arrays`; None: local-global
        self._operators: dict[int, _Operators] = {}
        self._clock = clock()
        self._waiting = 0

    def _of(self, elimination: DenseElimination) -> "_Operators":
        # the id is a unique key, since the space keeps all its reduced systems (eliminations)
        key = id(elimination)
        if key not in self._operators:
            inertia = self._space.inertia_matrix
            own = self._operators[key] = _Operators(self._sampled, elimination, inertia)
            if self.enough is not None:
                own.newton = newton_arrays(self._sampled, self._space, elimination, self.enough)
        return self._operators[key]

    def iterate(
        self, elimination: DenseElimination, s: np.ndarray, base: np.ndarray, iterations: int
    ) -> np.ndarray:
        """Compute coordinates (K, 3) after a frame's iterations from s; ``base``: (M/h^2) s."""
        own, sampled, free = self._of(elimination), self._sampled, elimination.free
        sampled.refresh()
        targets = vectors(len(elimination.fixed))
        targets[: elimination.targets.size] = elimination.targets.ravel()
        product(own.coupling, own.rows, len(elimination.fixed), own.nothing, targets, own.offset)
        count = 3 * len(free)
        own.constant[:count] = elimination.solved(base).ravel()
        own.z[:count] = s[free].ravel()
        arrays = own.iterated, sampled.arrays, self._history(free), own.newton
        run_iterations(iterations, len(free), own.rows, *arrays)
        y = s.copy()
        y[free] = own.z[:count].reshape(-1, 3)
        return y

    def _history(self, free: np.ndarray) -> History | None:
        """Empty history of Anderson acceleration for ``free`` coordinates; None if unused."""
        if self._acceleration is None:
            return NO_HISTORY
        self._acceleration.begin_frame(np.empty((len(free), 3)))
        return self._acceleration.history

    def run(
        self, q: np.ndarray, v: np.ndarray, frames: range, h: float, iterations: int, track: bool,
        anchors: Anchors,
    ) -> Blocks | None:  # fmt: skip
        """Compute as many of ``frames`` in turn as one compiled call can; ``track`` is ignored.

        Return None if the body touches a floor in the first frame, and in the next `BLOCK` - 1
        calls, as contacts last: the caller then computes one frame by `iterate`.
        """
        if self._waiting and frames.start:
            self._waiting -= 1
            return None
        fixed, targets, anchors = self._space.held_path(frames[:BLOCK], q, anchors)
        elimination = self._space.elimination(fixed)
        own, count = self._of(elimination), len(targets)
        positions, velocities = np.empty((2, count + 1, *q.shape))
        positions[0], velocities[0] = q, v
        seconds = np.zeros((count, 4))
        run_frames(
            positions, velocities, *self._space.affine, h, elimination.fixed, elimination.free,
            targets, own.begun, iterations, own.rows, own.iterated, self._sampled.arrays,
            self._history(elimination.free), own.newton, seconds, self._clock,
        )  # fmt: skip
        free = self._space.free_frames(positions[1:])
        if free == 0:
            self._waiting = BLOCK - 1
            return None
        done = slice(1, free + 1)
        return (positions[done], velocities[done], np.empty((free, 0)), seconds[:free]), anchors


class _Sampled:
    """Arrays of the sampled elements of all groups, one group after the other."""

    def __init__(self, steps: Sequence[SubspaceLocalStep]) -> None:
        groups = [step.group for step in steps]
        self.groups = groups
        self.strain = np.vstack([step.strain for step in steps])
        self.row_weights = np.concatenate([group.row_weights for group in groups])
        rows = [group.elements * group.rows_per_element for group in groups]
        parts = [group.kernel_parameters().ravel() for group in groups]
        self._starts = np.concatenate([[0], np.cumsum([len(part) for part in parts])])
        self._parameters = np.concatenate(parts)
        self._lagged = [i for i, group in enumerate(groups) if group.frame_lagged]
        self.arrays = (
            np.array([group.gradient_kernel.address for group in groups]),
            np.array([group.elements for group in groups]),
            np.concatenate([[0], np.cumsum(rows)]),
            self._parameters,
            self._starts,
            vectors(len(self.strain)),
            vectors(len(self.strain)),
        )
        """Groups: kernel addresses, elements, first rows, parameters and their starts; S q; p."""

    def refresh(self) -> None:
        """Copy to `arrays` the parameters that groups have computed at the frame's beginning."""
        for i in self._lagged:
            start, stop = self._starts[i : i + 2]
            self._parameters[start:stop] = self.groups[i].kernel_parameters().ravel()


class _Operators:
    """Matrices and vectors of an iteration, for one set of subspace coordinates that are fixed.

    iterated : D, L^T, d_0, c, z of the module's docstring; row weights, M/h^2 of free coordinates
        and working memory, for the objective
    begun : matrices that map s to c and fixed coordinates to d_0, zeros, arrays for these inputs
    """

    newton: tuple[Any, ...] | None = None

    def __init__(
        self, sampled: _Sampled, elimination: DenseElimination, inertia: np.ndarray
    ) -> None:
        strain, free, fixed = sampled.strain, elimination.free, elimination.fixed
        self.rows = len(strain)
        lift = elimination.lift(sampled.row_weights[:, None] * strain)
        self.offset, self.constant, self.z = (vectors(n) for n in (self.rows, *[len(free)] * 2))
        self.nothing = vectors(max(len(inertia), self.rows))
        self.coupling = blocks(strain[:, fixed])
        self.iterated = (
            blocks(strain[:, free]), blocks(lift.T), self.offset, self.constant, self.z,
            sampled.row_weights, np.ascontiguousarray(inertia[np.ix_(free, free)]),
            np.empty(3 * len(free)),
        )  # fmt: skip
        response = blocks(elimination.response(inertia))
        self.begun = (
            response, self.coupling, self.nothing, vectors(len(inertia)), vectors(len(fixed))
        )  # fmt: skip


@compiled(nogil=True)
def run_iterations(count, size, rows, operators, sampled, history, newton):
    """Do ``count`` iterations that change ``size`` free subspace coordinates z in place.

    rows : number of rows of all sampled elements
    operators, sampled : `_Operators.iterated`, with z; `_Sampled.arrays`
    history : arrays of Anderson acceleration, see `Anderson`; `NO_HISTORY` without it
    newton : `newton_arrays`; with them, iterations are those of `run_newton`
    """
    if newton is not None:
        return run_newton(count, size, rows, operators, sampled, newton)
    strain, lift, offset, constant, z, weights, inertia, start = operators
    d, p = sampled[5:]
    y = z[: 3 * size]
    if history is not None:
        copy(y, start)
        forget(history)
    for k in range(count):
        project(strain, rows, size, offset, z, sampled)
        refused = False
        if history is not None:
            refused = refuse(history, y, objective(weights, d, p, inertia, y, start))
        if not refused:
            product(lift, size, rows, constant, p, z)
            if history is not None and k < count - 1:
                combine(history, y)


@inner
def _predict(z, v, acceleration, rate, rates, h, s):
    """Write the prediction s = z + h v + h^2 (a + c v + C v); a, c and C as in `run_frames`."""
    for i in range(len(z)):
        for axis in range(3):
            total = acceleration[i, axis] + rate * v[i, axis]
            for k in range(len(rates)):
                total += rates[i, k] * v[k, axis]
            s[3 * i + axis] = z[i, axis] + h * v[i, axis] + h**2 * total


@compiled(nogil=True)
def run_frames(
    positions, velocities, acceleration, rate, rates, h, fixed, free, targets, begun, count,
    rows, operators, sampled, history, newton, seconds, watch,
):  # fmt: skip
    """Compute one frame for each of ``targets`` by `run_iterations`.

    positions, velocities : (F + 1, K, 3) coordinates, the first ones given, the others written
    acceleration, rate, rates : a, c, C of the acceleration a + c v + C v by all forces
    fixed, free : (m,), (K',) indices of the fixed coordinates and of the free ones
    targets : (F, m, 3) values of the fixed coordinates in each frame
    begun : matrices for the start of a frame, see `_Operators`
    count, rows, operators, sampled, history, newton : see `run_iterations`
    seconds : (F, 4) s, times of the phases of each frame, written
    watch : buffer for the clock, from `pdrom.model.compiled.functions.clock`
    """
    response, coupling, nothing, s, held = begun
    offset, constant, z = operators[2:5]
    for f in range(len(targets)):
        began = now(watch)
        before, after, speeds = positions[f], positions[f + 1], velocities[f + 1]
        _predict(before, velocities[f], acceleration, rate, rates, h, s)
        changed = f == 0
        for i in range(len(fixed)):
            for axis in range(3):
                changed = changed or targets[f, i, axis] != held[3 * i + axis]
                s[3 * fixed[i] + axis] = held[3 * i + axis] = targets[f, i, axis]
        product(response, len(free), len(before), nothing, s, constant)
        # with unchanged targets, ``offset`` is that of the previous frame
        if changed:
            product(coupling, rows, len(fixed), nothing, held, offset)
        for i in range(len(free)):
            for axis in range(3):
                z[3 * i + axis] = s[3 * free[i] + axis]
        between = now(watch)
        run_iterations(count, len(free), rows, operators, sampled, history, newton)
        ended = now(watch)
        for i in range(len(free)):
            for axis in range(3):
                s[3 * free[i] + axis] = z[3 * i + axis]
        for i in range(len(before)):
            for axis in range(3):
                after[i, axis] = s[3 * i + axis]
                speeds[i, axis] = (after[i, axis] - before[i, axis]) / h
        seconds[f, 0], seconds[f, 1] = between - began, ended - between
        seconds[f, 3] = now(watch) - ended
