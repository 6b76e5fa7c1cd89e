"""Frames in one compiled loop over the sampled elements.

In the free coordinates z of a position subspace one iteration is

    d = D z + d_0        S q of the sampled elements, d_0 from the held coordinates
    p = p(d)             projections
    z = c + L^T p        global solve, with c = A^-1 (M/h^2 s - load) and L = W D A^-1

D and L are (m p, K'): two small dense products and the projections, nothing else, no allocation,
and no array that grows with the mesh. Without frame-lagged groups c is one product, of s with its
held coordinates at their targets, and a call does many frames: those before the first that meets
a floor.
"""

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import TypeGuard

import numpy as np

from pdrom.model.compiled.clock import clock
from pdrom.model.dynamics.acceleration import NO_HISTORY, Anderson, History
from pdrom.model.dynamics.space import Solve
from pdrom.model.dynamics.stepper import LocalStep, Stepper
from pdrom.model.dynamics.whole_frames import BLOCK, Blocks
from pdrom.reduction.subspace.dense import blocks, product, read, vectors, write
from pdrom.reduction.subspace.fused_frames import frames as run_frames
from pdrom.reduction.subspace.fused_frames import iterations as run_iterations
from pdrom.reduction.subspace.local_step import SubspaceLocalStep
from pdrom.reduction.subspace.space import DenseElimination, ReducedSpace


class FusedStepper(Stepper):
    """The step loop with fused iterations; same results as the plain one up to round-off.

    Its time counts as local: there is no separate global step. A loop with other local steps than
    `SubspaceLocalStep`, or with a group without a gradient kernel, iterates as the plain one does.
    """

    def __init__(
        self,
        space: ReducedSpace,
        time_step: float,
        iterations: int,
        local_steps: Sequence[LocalStep],
        acceleration: Anderson | None = None,
    ) -> None:
        super().__init__(space, time_step, iterations, local_steps, False, acceleration)
        self._fused: _Fused | None = None
        if _fusible(local_steps):
            self._fused = _Fused(space, _Sampled(local_steps), acceleration)
            if space.whole_frames and not any(s.group.frame_lagged for s in local_steps):
                self._whole = self._fused

    def _iterate(
        self,
        s: np.ndarray,
        base: np.ndarray,
        elimination: Solve,
        seconds: np.ndarray,
        on_last_iterate: Callable[[np.ndarray], None] | None,
    ) -> tuple[np.ndarray, np.ndarray]:
        watched = on_last_iterate is not None
        if self._fused is None or watched or not isinstance(elimination, DenseElimination):
            return super()._iterate(s, base, elimination, seconds, on_last_iterate)
        before = perf_counter()
        y = self._fused.iterate(elimination, s, base, self.iterations)
        seconds[1] += perf_counter() - before
        return y, np.empty(0)


def _fusible(steps: Sequence[LocalStep]) -> TypeGuard[Sequence[SubspaceLocalStep]]:
    return all(
        isinstance(step, SubspaceLocalStep) and step.group.gradient_kernel is not None
        for step in steps
    )


class _Fused:
    """Iterations and frames in a space, with the operators of every set of held coordinates."""

    def __init__(
        self, space: ReducedSpace, sampled: "_Sampled", acceleration: Anderson | None
    ) -> None:
        self._space, self._sampled, self._acceleration = space, sampled, acceleration
        self._operators: dict[int, _Operators] = {}
        self._clock = clock()
        self._waiting = 0

    def _of(self, elimination: DenseElimination) -> "_Operators":
        # eliminations live as long as their space
        key = id(elimination)
        if key not in self._operators:
            inertia = self._space.inertia_matrix
            self._operators[key] = _Operators(self._sampled, elimination, inertia)
        return self._operators[key]

    def iterate(
        self, elimination: DenseElimination, s: np.ndarray, base: np.ndarray, iterations: int
    ) -> np.ndarray:
        """Coordinates (K, 3) after the iterations of a frame that starts at s."""
        own, sampled, free = self._of(elimination), self._sampled, elimination.free
        sampled.refresh()
        targets = vectors(len(elimination.fixed))
        write(elimination.targets, targets)
        product(own.coupling, own.rows, len(elimination.fixed), own.nothing, targets, own.offset)
        write(elimination.solved(base), own.constant)
        write(s[free], own.z)
        run_iterations(
            iterations, len(free), own.rows, own.iterated, sampled.arrays, self._history(free)
        )
        y = s.copy()
        y[free] = read(own.z, len(free))
        return y

    def _history(self, free: np.ndarray) -> History | None:
        """Memory of the acceleration for iterates of the ``free`` coordinates."""
        if self._acceleration is None:
            return NO_HISTORY
        self._acceleration.begin_frame(np.empty((len(free), 3)))
        return self._acceleration.history

    def run(
        self, q: np.ndarray, v: np.ndarray, frames: range, h: float, iterations: int, track: bool
    ) -> Blocks | None:
        """Run as many of ``frames`` as one call can do, see `WholeFrames.run`; nothing is tracked.

        None in a frame that meets a floor, and for some frames after it: it is likely still there.
        """
        if self._waiting and frames.start:
            self._waiting -= 1
            return None
        fixed, targets = self._space.held_path(frames[:BLOCK], q)
        elimination = self._space.elimination(fixed)
        own, count = self._of(elimination), len(targets)
        positions, velocities = np.empty((2, count + 1, *q.shape))
        positions[0], velocities[0] = q, v
        seconds = np.zeros((count, 4))
        run_frames(
            positions, velocities, *self._space.affine, h, elimination.fixed, elimination.free,
            targets, own.begun, iterations, own.rows, own.iterated, self._sampled.arrays,
            self._history(elimination.free), seconds, self._clock,
        )  # fmt: skip
        free = self._space.free_frames(positions[1:])
        if free == 0:
            self._waiting = BLOCK - 1
            return None
        done = slice(1, free + 1)
        return positions[done], velocities[done], np.empty((free, 0)), seconds[:free]


class _Sampled:
    """Sampled elements of all groups, one after the other."""

    def __init__(self, steps: Sequence[SubspaceLocalStep]) -> None:
        groups = [step.group for step in steps]
        self._groups = groups
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
        """Addresses, elements, first rows, parameters and their starts, S q, projections."""

    def refresh(self) -> None:
        """Take over what the groups froze at the beginning of the frame."""
        for i in self._lagged:
            start, stop = self._starts[i : i + 2]
            self._parameters[start:stop] = self._groups[i].kernel_parameters().ravel()


class _Operators:
    """Matrices of an iteration for one set of held coordinates, and its vectors.

    iterated : D, L^T, d_0, c and z; weights of the rows, M/h^2 of the free coordinates and room for
        a difference of them, for the objective
    begun : product that gives c from s, coupling to the held coordinates, working vectors
    """

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
