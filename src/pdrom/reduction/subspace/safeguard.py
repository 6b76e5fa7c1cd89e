"""Interpolated iterations that may not raise a sampled objective.

Interpolation needs few elements and promises nothing; energy-conserving sampling promises that its
objective cannot rise, and needs many elements to be accurate. A frame is therefore iterated with
the interpolation, and the objective of a coarse sampling,

    1/(2 h^2) |M^1/2 (y - s)|^2 + 1/2 sum_e xi_e w_e |S_e y - p_e(y)|^2,   xi_e >= 0,

is evaluated at its start s and at its end. If it has risen, the frame is repeated with the
iterations of this sampling, which cannot raise it. So no frame raises the sampled objective,
whatever the interpolation does, and an accurate one is left alone as it also lowers the objective
that the sampling stands for. The control elements are evaluated twice a frame, not in every
iteration.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from pdrom.model.dynamics.space import Solve
from pdrom.model.dynamics.stepper import LocalStep, State, Stepper
from pdrom.reduction.subspace.local_step import SubspaceLocalStep
from pdrom.reduction.subspace.space import ReducedSpace

# Relative rounding of S y - p; its energy R lets an objective E rise by 2 sqrt(E R) + R.
ROUNDOFF = 64.0 * np.finfo(float).eps


class ControlStepper(Stepper):
    """Iterations of the coarse sampling, begun beside those that it controls."""

    local_steps: list[SubspaceLocalStep]  # type: ignore[assignment]

    def begin(self, state: State, frame: int) -> None:
        """Prepare a ``frame`` that begins in ``state``."""
        self._s, self._elimination, self._base = self._begin(state, frame)

    def objective(self, y: np.ndarray) -> float:
        """Sampled objective of the frame at ``y`` (K, 3), J."""
        unused = np.zeros_like(y)
        energy = sum(step.accumulate(y, unused) for step in self.local_steps)
        return energy + self.space.inertia_energy(y - self._s)

    def rounding(self, y: np.ndarray, objective: float) -> float:
        """Largest rise of an objective of this size at ``y`` (K, 3) by rounding, J."""
        squares = sum(float(np.vdot(y, step.matrix @ y)) for step in self.local_steps)
        noise = 0.5 * ROUNDOFF**2 * squares
        return 2.0 * float(np.sqrt(objective * noise)) + noise

    def iterate(
        self, seconds: np.ndarray, on_last_iterate: Callable[[np.ndarray], None] | None
    ) -> np.ndarray:
        """Coordinates (K, 3) after the frame's iterations.

        Their times are added to ``seconds`` (4,) s; ``on_last_iterate`` sees the last iterate.
        """
        rest: Any = (self._s, self._base, self._elimination, seconds, on_last_iterate)
        return self._iterate(*rest)[0]


class SafeguardedStepper(Stepper):
    """The step loop of an interpolation whose frames fall back where a sampled objective rises.

    Its frames report the sampled objective at their beginning and at their end.

    Attributes
    ----------
    fallbacks : frames that were repeated so far
    """

    def __init__(
        self,
        space: ReducedSpace,
        time_step: float,
        iterations: int,
        local_steps: Sequence[LocalStep],
        control: ControlStepper,
    ) -> None:
        super().__init__(space, time_step, iterations, local_steps, track_objective=False)
        self._control = control
        self.fallbacks = 0

    def _begin(self, state: State, frame: int) -> tuple[np.ndarray, Solve, np.ndarray]:
        self._control.begin(state, frame)
        return super()._begin(state, frame)

    def _iterate(
        self,
        s: np.ndarray,
        base: np.ndarray,
        elimination: Solve,
        seconds: np.ndarray,
        on_last_iterate: Callable[[np.ndarray], None] | None,
    ) -> tuple[np.ndarray, np.ndarray]:
        last: list[np.ndarray] = []
        control = self._control
        with np.errstate(over="ignore", invalid="ignore"):
            y, _ = super()._iterate(s, base, elimination, seconds, lambda z: last.append(z.copy()))
            before, after = control.objective(s), control.objective(y)
        # what is not finite has risen
        if after <= before + control.rounding(s, before):
            if on_last_iterate is not None:
                on_last_iterate(last[0])
            return y, np.array([before, after])
        self.fallbacks += 1
        y = control.iterate(seconds, on_last_iterate)
        return y, np.array([before, control.objective(y)])
