"""A reduced local step that keeps an eye on itself: its coefficients and its energy."""

from collections.abc import Collection

import numpy as np

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import WatchedStep
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.sampling.reduction import Reduction


class WatchedLocalStep(ReducedLocalStep, WatchedStep):
    """`ReducedLocalStep` that adds the same bits to the right-hand side and looks at them.

    It looks at the middle and at the last of the K iterations only, to be cheap: at the
    coefficients, and at the energy 1/2 |W^1/2 (S y - p^)|^2 against its own reduced projections p^.
    With a basis that holds the projections this energy, and with it the objective, cannot rise.

    Parameters
    ----------
    iterations : K of the step loop
    """

    def __init__(self, group: ConstraintGroup, reduction: Reduction, iterations: int) -> None:
        """Watch a ``reduction`` of ``group`` in a frame of so many ``iterations``."""
        super().__init__(group, reduction)
        self._iterations = iterations
        self._boxes = [_Box(*_trained(reduction, b.axis)) for b in reduction.blocks]
        self._stiffness = group.system_matrix()
        weights = np.repeat(group.row_weights, 3)
        mean = reduction.basis.mean
        self._constant = 0.5 * float(weights @ mean**2)
        self._squares = []
        for block in reduction.blocks:
            modes, own = reduction.v[block.output], weights[block.output]
            linear = modes.T @ (own * mean[block.output])
            self._squares.append((linear, 0.5 * modes.T @ (own[:, None] * modes)))
        self.projection_energy = 0.0
        """1/2 |W^1/2 p^|^2 at the last iterate looked at: the size of the terms that cancel."""

    @property
    def watched(self) -> Collection[int]:
        """Iterations that compiled code leaves out."""
        return (self._iterations // 2, self._iterations - 1)

    def begin_frame(self, q: np.ndarray) -> None:
        for box in self._boxes:
            box.reset()
        super().begin_frame(q)

    def look(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Do a watched `accumulate` of ``y``, ``rhs`` (N, 3); its energy is a reduced one."""
        before = rhs.copy()
        self.accumulate(y, rhs)
        for box, own in zip(self._boxes, self.coefficients, strict=True):
            box.include(own)
        return self._energy(y, rhs - before)

    def distance(self) -> float:
        """Largest distance of the frame's coefficients from the trained box over its diagonal.

        inf or nan if coefficients are not finite.
        """
        return max((box.distance() for box in self._boxes), default=0.0)

    def _energy(self, y: np.ndarray, added: np.ndarray) -> float:
        """1/2 |W^1/2 (S y - p^)|^2 from S^T W p^ (``added``) and the coefficients of p^."""
        squares = zip(self.coefficients, self._squares, strict=True)
        own = self._constant + sum(float(c @ (linear + gram @ c)) for c, (linear, gram) in squares)
        self.projection_energy = own
        return float(np.vdot(y, 0.5 * (self._stiffness @ y) - added)) + own


def _trained(reduction: Reduction, axis: int | None) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest trained coefficients (r,) of a block.

    Where the basis shares its coefficients but the method solves axis by axis, each axis should
    find the shared ones.
    """
    trained = reduction.basis.trained
    low, high = trained[axis if len(trained) == 3 and axis is not None else 0]
    return low[: reduction.r], high[: reduction.r]


class _Box:
    """Range of the trained coefficients, and of those of a frame."""

    def __init__(self, low: np.ndarray, high: np.ndarray) -> None:
        self._low, self._high = low, high
        self._diagonal = float(np.linalg.norm(high - low))
        self._seen_low, self._seen_high = np.empty_like(low), np.empty_like(high)
        self.reset()

    def reset(self) -> None:
        self._seen_low.fill(np.inf)
        self._seen_high.fill(-np.inf)

    def include(self, coefficients: np.ndarray) -> None:
        np.minimum(self._seen_low, coefficients, out=self._seen_low)
        np.maximum(self._seen_high, coefficients, out=self._seen_high)

    def distance(self) -> float:
        outside = np.maximum(self._low - self._seen_low, self._seen_high - self._high)
        distance = float(np.linalg.norm(np.maximum(outside, 0.0)))
        return distance / self._diagonal if self._diagonal > 0.0 else distance
