"""Training of models in position subspaces: columns, and elements sampled on training runs."""

from collections.abc import Sequence

import numpy as np

from pdrom.model.dynamics.stepper import State
from pdrom.model.scene import Scene
from pdrom.reduction.subspace import columns as spaces
from pdrom.reduction.subspace.ecsw import Choose, ecsw_elements, training_run
from pdrom.reduction.subspace.model import SubspaceModel

# Elements are sampled on the iterates of this many frames, in equal shares of all training runs.
FRAMES = 70


def make_columns(
    scenes: Sequence[Scene],
    training: np.ndarray,
    pod: int = 0,
    skinning: int = 0,
    own: np.ndarray | None = None,
    hold: Sequence[np.ndarray] = (),
) -> spaces.Columns:
    """Build columns of a position subspace for ``scenes``; fewer if the data have fewer modes.

    scenes : training scenes, on one mesh; vertices that they hold have separate columns
    training : (n, N, 3) m, positions in the training frames
    pod, skinning : numbers of POD modes and of skinning modes
    own : (N, k) columns instead of POD modes
    hold : further sets of vertices that a scene may hold
    """
    points, masses = scenes[0].mesh.points, scenes[0].masses
    parts = []
    if own is not None:
        parts.append(own)
    elif pod or not skinning:
        parts.append(spaces.displacement_modes(training, points, masses, pod))
    if skinning:
        parts.append(spaces.skinning_modes(points, masses, skinning))
    atoms = spaces.atoms([*hold, *held_units(scenes)], len(points))
    motion = training if own is None else None
    return spaces.build_columns(np.hstack(parts), points, masses, atoms, motion)


def held_units(scenes: Sequence[Scene]) -> list[np.ndarray]:
    """List sets of vertices that a boundary condition of ``scenes`` always fixes together."""
    return [unit for scene in scenes for own in scene.boundaries for unit in own.units()]


def sampled_models(
    scenes: Sequence[Scene],
    columns: spaces.Columns,
    frames: np.ndarray,
    tolerances: Sequence[float],
    start: State | None = None,
    choose: Choose | None = None,
) -> list[SubspaceModel]:
    """Train a model in ``columns`` for each tolerance, with energy-conserving samples of groups.

    Training data are iterates of runs of ``scenes`` in the subspace, in equal shares of ``frames``.
    The first run begins at ``start``, in subspace coordinates, or (if None) at its initial state.
    ``choose`` selects elements instead of non-negative least squares.
    """
    count, training = -(-FRAMES // len(scenes)), []
    for i, scene in enumerate(scenes):
        own = frames[frames < scene.config.frames]
        chosen = own[np.unique(np.linspace(0, len(own) - 1, count).round().astype(int))]
        training += training_run(scene, columns, chosen, None if i else start)
    found = {
        group.name: ecsw_elements(group, columns, training, tolerances, choose)
        for group in scenes[0].groups
    }
    return [
        SubspaceModel(columns, {name: solutions[i] for name, solutions in found.items()})
        for i in range(len(tolerances))
    ]
