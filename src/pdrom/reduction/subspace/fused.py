"""All iterations of a frame in one compiled loop over the sampled elements.

In the free coordinates z of a position subspace one iteration is

    d = D z + d_0        S q of the sampled elements, d_0 from the held coordinates
    p = p(d)             projections
    z = c + L^T p        global solve, with c = A^-1 (M/h^2 s - load) and L = W D A^-1

D and L are (m p, K'): two small dense products and the projections, nothing else, no allocation,
and no array that grows with the mesh.
"""

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import TypeGuard

import numpy as np
from numba import njit

from pdrom.model.constraints.gradient_kernel import call
from pdrom.model.dynamics.acceleration import Anderson
from pdrom.model.dynamics.space import Solve
from pdrom.model.dynamics.stepper import LocalStep, Stepper
from pdrom.reduction.subspace.local_step import SubspaceLocalStep
from pdrom.reduction.subspace.space import DenseElimination, ReducedSpace


class FusedStepper(Stepper):
    """The step loop with fused iterations; same results as the plain one up to round-off.

    Its time counts as local: there is no separate global step. A loop with other local steps than
    `SubspaceLocalStep`, with a group without a gradient kernel, or with an acceleration iterates as
    the plain one does.
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
        self._sampled = None
        if acceleration is None and _fusible(local_steps):
            self._sampled = _Sampled(local_steps)
        self._operators: dict[int, _Operators] = {}

    def _iterate(
        self,
        s: np.ndarray,
        base: np.ndarray,
        elimination: Solve,
        seconds: np.ndarray,
        on_last_iterate: Callable[[np.ndarray], None] | None,
    ) -> tuple[np.ndarray, np.ndarray]:
        watched = on_last_iterate is not None
        if self._sampled is None or watched or not isinstance(elimination, DenseElimination):
            return super()._iterate(s, base, elimination, seconds, on_last_iterate)
        before = perf_counter()
        # eliminations live as long as their space
        key = id(elimination)
        if key not in self._operators:
            self._operators[key] = _Operators(self._sampled, elimination)
        self._sampled.refresh()
        y = self._operators[key].iterate(self._sampled, s, base, self.iterations)
        seconds[1] += perf_counter() - before
        return y, np.empty(0)


def _fusible(steps: Sequence[LocalStep]) -> TypeGuard[Sequence[SubspaceLocalStep]]:
    return all(
        isinstance(step, SubspaceLocalStep) and step.group.gradient_kernel is not None
        for step in steps
    )


class _Sampled:
    """Sampled elements of all groups, one after the other."""

    def __init__(self, steps: Sequence[SubspaceLocalStep]) -> None:
        groups = [step.group for step in steps]
        self._groups = groups
        self.strain = np.vstack([step.strain for step in steps])
        self.row_weights = np.concatenate([group.row_weights for group in groups])
        rows = [group.elements * group.rows_per_element for group in groups]
        self.addresses = np.array([group.gradient_kernel.address for group in groups])
        self.elements = np.array([group.elements for group in groups])
        self.starts = np.concatenate([[0], np.cumsum(rows)])
        parts = [group.kernel_parameters().ravel() for group in groups]
        self.parameter_starts = np.concatenate([[0], np.cumsum([len(part) for part in parts])])
        self.parameters = np.concatenate(parts)
        self._lagged = [i for i, group in enumerate(groups) if group.frame_lagged]
        self.gradients = np.empty((len(self.strain), 3))
        self.projections = np.empty((len(self.strain), 3))

    def refresh(self) -> None:
        """Take over what the groups froze at the beginning of the frame."""
        for i in self._lagged:
            start, stop = self.parameter_starts[i : i + 2]
            self.parameters[start:stop] = self._groups[i].kernel_parameters().ravel()


class _Operators:
    """D, L and the coupling to the held coordinates, for one set of those."""

    def __init__(self, sampled: _Sampled, elimination: DenseElimination) -> None:
        self._elimination = elimination
        strain, free = sampled.strain, elimination.free
        self._strain = np.ascontiguousarray(strain[:, free])
        self._coupling = np.ascontiguousarray(strain[:, elimination.fixed])
        self._lift = np.ascontiguousarray(elimination.lift(sampled.row_weights[:, None] * strain))
        self._offset = np.zeros((len(strain), 3))
        self._z = np.empty((3, len(free)))

    def iterate(
        self, sampled: _Sampled, s: np.ndarray, base: np.ndarray, iterations: int
    ) -> np.ndarray:
        """Coordinates (K, 3) after the iterations of a frame that starts at s."""
        elimination = self._elimination
        if len(elimination.fixed):
            np.matmul(self._coupling, elimination.targets, out=self._offset)
        constant = np.ascontiguousarray(elimination.solved(base).T)
        self._z[...] = s[elimination.free].T
        _iterations(
            iterations, self._strain, self._lift, self._offset, constant, self._z,
            sampled.addresses, sampled.elements, sampled.starts, sampled.parameters,
            sampled.parameter_starts, sampled.gradients, sampled.projections,
        )  # fmt: skip
        y = s.copy()
        y[elimination.free] = self._z.T
        return y


# sums may be reordered, which vectorises the dot products; nan and inf keep their meaning
@njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def _iterations(
    count, strain, lift, offset, constant, z,
    addresses, elements, starts, parameters, parameter_starts, d, p,
):  # fmt: skip
    rows, size = strain.shape
    for _ in range(count):
        for row in range(rows):
            dx, dy, dz = offset[row, 0], offset[row, 1], offset[row, 2]
            for k in range(size):
                value = strain[row, k]
                dx += value * z[0, k]
                dy += value * z[1, k]
                dz += value * z[2, k]
            d[row, 0], d[row, 1], d[row, 2] = dx, dy, dz
        for g in range(len(addresses)):
            call(
                addresses[g],
                d[starts[g] :].ctypes.data,
                parameters[parameter_starts[g] :].ctypes.data,
                p[starts[g] :].ctypes.data,
                elements[g],
            )
        z[...] = constant
        for row in range(rows):
            px, py, pz = p[row, 0], p[row, 1], p[row, 2]
            for k in range(size):
                value = lift[row, k]
                z[0, k] += value * px
                z[1, k] += value * py
                z[2, k] += value * pz
