"""The first frames of a full-order run, on which models of a mesh size are trained."""

from dataclasses import dataclass

import numpy as np

from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene


@dataclass(frozen=True)
class Training:
    """Positions (n, N, 3) m after the training frames, and projections (n, e p, 3) within them.

    ``roundoff`` (n,) is that of the projections.
    """

    positions: np.ndarray
    projections: np.ndarray
    roundoff: np.ndarray

    def first(self, frames: int) -> "Training":
        """Keep the first frames only."""
        return Training(self.positions[:frames], self.projections[:frames], self.roundoff[:frames])


def train(scene: Scene, system: GlobalSystem, frames: int) -> Training:
    """First ``frames`` of the full-order run of ``scene`` with the matrix of ``system``.

    The projections are those at the last local iterates.
    """
    group = scene.groups[0]
    loop, state = scene.stepper(system, track_objective=False), scene.initial_state()
    positions, projections, roundoff = [], [], []

    def watch(y: np.ndarray) -> None:
        projections.append(group.project(y))
        roundoff.append(group.roundoff(y))

    for frame in range(frames):
        state, _ = loop.step(state, frame, watch)
        positions.append(state.positions)
    return Training(np.stack(positions), np.stack(projections), np.array(roundoff))
