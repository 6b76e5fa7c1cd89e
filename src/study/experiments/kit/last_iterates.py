"""Values of a function at the last local iterate of every frame of a full-order run."""

from collections.abc import Callable

import numpy as np

from pdrom.model.dynamics.stepper import Stepper
from pdrom.model.scene import Scene

Look = Callable[[np.ndarray], np.ndarray]


def last_iterates(
    scene: Scene, loop: Stepper, look: Look, start: np.ndarray | None = None
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Positions (F + 1, N, 3) of a run, and what ``look`` returns for the last iterate of a frame.

    ``loop`` is the step loop of ``scene``; ``start`` (N, 3) m is added to the initial positions.
    """
    state = scene.initial_state(start)
    positions, seen = [state.positions], []
    for frame in range(scene.config.frames):
        state, _ = loop.step(state, frame, lambda y: seen.append(look(y)))
        positions.append(state.positions)
    return np.stack(positions), seen
