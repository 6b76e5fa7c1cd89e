"""The motion with the time step going to zero, with an estimate of its own error."""

from dataclasses import dataclass

import numpy as np

from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.explicit import Explicit

UNSTABLE = 1e100  # m; of a larger run, or one that is not finite, no change is estimated


@dataclass(frozen=True)
class Continuous:
    """Positions (F + 1, N, 3) m at the ends of frames, the initial ones first.

    error : estimate of || Q - Q_exact || / || Q - Q_0 ||, from the change by the last halving
    substeps : explicit steps of a frame
    """

    positions: np.ndarray
    error: float
    substeps: int

    def within(self, tolerance: float) -> bool:
        """Whether the estimate meets a tolerance."""
        return self.error <= tolerance


def continuous(
    scene: Scene, frames: int, tolerance: float, substeps: int, limit: int
) -> Continuous:
    """Explicit steps through so many ``frames`` of ``scene``, halved until the error is small.

    Parameters
    ----------
    tolerance : estimated relative error that ends the halving
    substeps : of a frame, to begin with; an unstable run is halved like an inaccurate one
    limit : on the substeps; the last run is returned, whatever its error
    """
    before, last = _positions(scene, frames, substeps), np.inf
    while True:
        substeps *= 2
        after = _positions(scene, frames, substeps)
        change = _change(before, after)
        error = _remaining(change, last)
        if error <= tolerance or 2 * substeps > limit:
            return Continuous(after, error, substeps)
        before, last = after, change


def _remaining(change: float, last: float) -> float:
    """Richardson estimate of the remaining error from two halvings.

    A third of the last ``change`` where changes fall to a quarter, as with a method of second
    order; all of it where they do not fall to a half, because the motion is not smooth or not yet
    resolved.
    """
    ratio = last / change if change > 0.0 and np.isfinite(last) else 1.0
    return change / min(max(ratio - 1.0, 1.0), 3.0)


def _positions(scene: Scene, frames: int, substeps: int) -> np.ndarray:
    loop, state = Explicit(scene, substeps), scene.initial_state()
    positions = [state.positions]
    for frame in range(frames):
        state, _ = loop.step(state, frame)
        positions.append(state.positions)
    return np.stack(positions)


def _change(before: np.ndarray, after: np.ndarray) -> float:
    """Relative change of a run; inf if one of them is unstable."""
    if not max(np.abs(before).max(), np.abs(after).max()) < UNSTABLE:
        return float("inf")
    difference, moved = np.linalg.norm(after - before), np.linalg.norm(after - after[0])
    return float(difference / moved) if moved > 0.0 else 0.0
