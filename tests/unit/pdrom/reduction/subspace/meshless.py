"""What every loop in a position subspace must satisfy: nothing of the mesh's size is read."""

import numpy as np

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.columns import Columns


def assert_reads_nothing_of_the_mesh(
    scene: Scene, columns: Columns, loop: Stepper, start: State
) -> None:
    """With everything of the length of the mesh overwritten a second run is the same."""

    def run() -> np.ndarray:
        state, states = start, []
        for frame in range(scene.config.frames):
            state, _ = loop.step(state, frame)
            states.append(state.positions)
        return np.stack(states)

    before = run()
    assert np.isfinite(before).all()
    for array in (columns.B, scene.mesh.points, scene.masses):
        array.setflags(write=True)
        array[...] = np.nan
    for group in scene.groups:
        group.S.data[...] = np.nan
        group.weights[...] = np.nan
    np.testing.assert_array_equal(run(), before)
