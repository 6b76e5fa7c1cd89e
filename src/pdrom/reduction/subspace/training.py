"""Training data of the element sampling: iterates of the position subspace with all projections.

One iteration in the subspace, A z' = (M/h^2) s + sum_e B^T S_e^T w_e p_e(B z), can be written as
sum_e g_e = (M/h^2)(s - z') with g_e = B^T S_e^T w_e (S_e B z' - p_e(B z)). Sampled elements whose
factors satisfy sum_e xi_e g_e = sum_e g_e map z to the same z', with their own matrix on the left.
So the pairs (z, z') of a run are what the factors must reproduce. A residual r of the equations
moves the next iterate by A^-1 r and misses the minimum of the iteration's quadratic objective by
1/2 r^T A^-1 r. That is how its size is measured here: in the plain norm the stiff coordinates would
hide errors of the soft ones, which the run follows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.local_step import SubspaceLocalStep
from pdrom.reduction.subspace.space import ReducedSpace, reduced_state


@dataclass(frozen=True)
class TrainingFrame:
    """A frame of the training run.

    start : (K, 3) coordinates at its beginning, which frame-lagged data are frozen at
    pairs : (n, 2, K, 3) coordinates before and after its iterations
    measure : (K', K) with |measure r|^2 = r^T A^-1 r for a residual r of the equations, J; held
        coordinates have no equation
    """

    start: np.ndarray
    pairs: np.ndarray
    measure: np.ndarray


def training_run(
    scene: Scene, columns: Columns, frames: Sequence[int], start: State | None = None
) -> list[TrainingFrame]:
    """Run the scene in the subspace with all projections; iterates of ``frames``, ascending.

    Only the training motion is run, and only ``frames`` of it are kept. It begins at ``start``, in
    coordinates (K, 3), or where the scene does.
    """
    steps = [SubspaceLocalStep(group, columns) for group in scene.groups]
    space = ReducedSpace(scene, columns, [step.matrix for step in steps])
    watch = _Watch(steps[0])
    config = scene.config
    loop = Stepper(
        space, config.time_step, config.iterations, [watch, *steps[1:]], track_objective=False
    )
    measures = _Measures(space)
    state = start or reduced_state(scene, columns)
    kept: list[TrainingFrame] = []
    wanted = {int(frame) for frame in frames}
    for frame in range(max(wanted) + 1):
        watch.iterates = [] if frame in wanted else None
        fixed = space.fixed(frame, state.positions)[0]
        first = state.positions
        state, _ = loop.step(state, frame)
        if frame in wanted:
            # a contact may have moved the end of the frame: then it is no iterate
            iterates = watch.iterates or []
            if len(iterates) == 1:
                iterates = [*iterates, state.positions]
            pairs = np.stack([iterates[:-1], iterates[1:]], axis=1)
            kept.append(TrainingFrame(first, pairs, measures.of(fixed)))
    return kept


class _Watch:
    """A local step that notes where it is evaluated."""

    def __init__(self, step: SubspaceLocalStep) -> None:
        self.name, self._step = step.name, step
        self.iterates: list[np.ndarray] | None = None

    def begin_frame(self, q: np.ndarray) -> None:
        self._step.begin_frame(q)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        if self.iterates is not None:
            self.iterates.append(y.copy())
        return self._step.accumulate(y, rhs)


class _Measures:
    """A^-1/2 of the coordinates that are not held, once per set of held ones."""

    def __init__(self, space: ReducedSpace) -> None:
        self._space = space
        self._cache: dict[bytes, np.ndarray] = {}

    def of(self, fixed: np.ndarray) -> np.ndarray:
        """Measure (K', K) with the coordinates ``fixed`` held."""
        key = fixed.tobytes()
        if key not in self._cache:
            size = len(self._space.matrix)
            free = np.setdiff1d(np.arange(size), fixed)
            root = linalg.cholesky(self._space.matrix[np.ix_(free, free)], lower=True)
            measure = np.zeros((len(free), size))
            measure[:, free] = linalg.solve_triangular(root, np.eye(len(free)), lower=True)
            self._cache[key] = measure
        return self._cache[key]
