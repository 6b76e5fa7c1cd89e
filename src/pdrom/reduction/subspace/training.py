"""Training data of the element sampling: iterates of the position subspace with all projections.

One iteration in the subspace, A z' = (M/h^2) s + sum_e B^T S_e^T w_e p_e(B z), can be written as
sum_e g_e = (M/h^2)(s - z') with g_e = B^T S_e^T w_e (S_e B z' - p_e(B z)). Sampled elements whose
factors satisfy sum_e xi_e g_e = sum_e g_e map z to the same z', with their own matrix on the left.
So the pairs (z, z') of a run are what the factors must reproduce. A residual r of the equations
moves the next iterate by A^-1 r and misses the minimum of the iteration's quadratic objective by
1/2 r^T A^-1 r. That is how its size is measured (`Norm` "energy"): in the plain norm the stiff
coordinates would hide errors of the soft ones, which the run follows.

"response" measures what r does to the run. In each mode of (K, M) the ends of frames obey
x_{n+1} / c^2 - 2 x_n + x_{n-1} = h^2 r_n with c^2 = 1 / (1 + h^2 omega^2). To an r_n that is new
in every frame this answers with the root mean square h^2 c^2 sqrt((1 + c^2) / (1 + 3 c^2)) /
(1 - c^2) of its own, which lies between 0.7 and 1 of the static answer 1 / omega^2. A mode without
stiffness is taken to have the answer of a run of the scene's length.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import linalg

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.local_step import SubspaceLocalStep
from pdrom.reduction.subspace.space import ReducedSpace, reduced_state

Norm = Literal["energy", "response"]


@dataclass(frozen=True)
class TrainingFrame:
    """A frame of the training run.

    start : (K, 3) coordinates at its beginning, which frame-lagged data are frozen at
    pairs : (n, 2, K, 3) coordinates before and after its iterations
    measure : (K', K) with |measure r| the size of a residual r of the equations in the chosen norm:
        |measure r|^2 = r^T A^-1 r, J, or |M^1/2 x|^2 of the run's response x, kg m^2; held
        coordinates have no equation
    """

    start: np.ndarray
    pairs: np.ndarray
    measure: np.ndarray


def training_run(
    scene: Scene,
    columns: Columns,
    frames: Sequence[int],
    start: State | None = None,
    norm: Norm = "energy",
) -> list[TrainingFrame]:
    """Run the scene in the subspace with all projections; iterates of ``frames``, ascending.

    Only the training motion is run, and only ``frames`` of it are kept. It begins at ``start``, in
    coordinates (K, 3), or where the scene does.

    Parameters
    ----------
    norm : in which the sampling's equations are measured
    """
    steps = [SubspaceLocalStep(group, columns) for group in scene.groups]
    space = ReducedSpace(scene, columns, [step.matrix for step in steps])
    watch = _Watch(steps[0])
    config = scene.config
    loop = Stepper(
        space, config.time_step, config.iterations, [watch, *steps[1:]], track_objective=False
    )
    measures = _Measures(space, norm, config.frames)
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
    """Measure of the coordinates that are not held, once per set of held ones."""

    def __init__(self, space: ReducedSpace, norm: Norm, frames: int) -> None:
        self._space, self._norm, self._frames = space, norm, frames
        self._cache: dict[bytes, np.ndarray] = {}

    def of(self, fixed: np.ndarray) -> np.ndarray:
        """Measure (K', K) with the coordinates ``fixed`` held."""
        key = fixed.tobytes()
        if key not in self._cache:
            size = len(self._space.matrix)
            free = np.setdiff1d(np.arange(size), fixed)
            block, inertia = (
                m[np.ix_(free, free)] for m in (self._space.matrix, self._space.inertia_matrix)
            )
            measure = np.zeros((len(free), size))
            energy = self._norm == "energy"
            measure[:, free] = _inverse_root(block) if energy else self._response(block, inertia)
            self._cache[key] = measure
        return self._cache[key]

    def _response(self, matrix: np.ndarray, inertia: np.ndarray) -> np.ndarray:
        """Root mean square response of each mode, for A and M / h^2 of the free coordinates."""
        values, modes = linalg.eigh(matrix, inertia)
        c2 = 1.0 / np.maximum(values, 1.0)
        beside = np.maximum(1.0 - c2, 1.0 / self._frames)
        return (c2 * np.sqrt((1.0 + c2) / (1.0 + 3.0 * c2)) / beside)[:, None] * modes.T


def _inverse_root(matrix: np.ndarray) -> np.ndarray:
    """A triangular R with R^T R = A^-1."""
    root = linalg.cholesky(matrix, lower=True)
    return linalg.solve_triangular(root, np.eye(len(matrix)), lower=True)
