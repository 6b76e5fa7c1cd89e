"""Energy-conserving sampling and weighting (Farhat et al. 2014) for projective dynamics.

A few elements with non-negative factors xi stand for all: sum_e xi_e g_e ~ sum_e g_e, where g_e is
what an element contributes to the reduced equations over the training iterates. The same factors
weight the element in the system matrix and in the right-hand side. The reduced problem is then
again a projective-dynamics problem, with weights xi_e w_e >= 0: whatever the factors and the state,
its objective cannot rise in an iteration. Their quality decides the accuracy, not the stability.

Training iterates are those of the position subspace with all projections. One iteration there,
A z' = (M/h^2) s + sum_e B^T S_e^T w_e p_e(B z), can be written as sum_e g_e = (M/h^2)(s - z') with
g_e = B^T S_e^T w_e (S_e B z' - p_e(B z)). Sampled elements whose factors satisfy
sum_e xi_e g_e = sum_e g_e map z to the same z', with their own matrix on the left. So the pairs
(z, z') of a run are what the factors must reproduce. A residual r of the equations moves the next
iterate by A^-1 r and misses the minimum of the iteration's quadratic objective by 1/2 r^T A^-1 r.
That is how its size is measured (`Norm` "energy"): in the plain norm the stiff coordinates would
hide errors of the soft ones, which the run follows.

"response" measures what r does to the run. In each mode of (K, M) the ends of frames obey
x_{n+1} / c^2 - 2 x_n + x_{n-1} = h^2 r_n with c^2 = 1 / (1 + h^2 omega^2). To an r_n that is new
in every frame this answers with the root mean square h^2 c^2 sqrt((1 + c^2) / (1 + 3 c^2)) /
(1 - c^2) of its own, which lies between 0.7 and 1 of the static answer 1 / omega^2. A mode without
stiffness is taken to have the answer of a run of the scene's length.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Literal

import numpy as np
from numba import njit
from scipy import linalg

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.local_step import SubspaceLocalStep
from pdrom.reduction.subspace.nnls import nnls_path
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
            if self._norm == "energy":  # a triangular R with R^T R = A^-1
                root = linalg.cholesky(block, lower=True)
                measure[:, free] = linalg.solve_triangular(root, np.eye(len(block)), lower=True)
            else:
                measure[:, free] = self._response(block, inertia)
            self._cache[key] = measure
        return self._cache[key]

    def _response(self, matrix: np.ndarray, inertia: np.ndarray) -> np.ndarray:
        """Root mean square response of each mode, for A and M / h^2 of the free coordinates."""
        values, modes = linalg.eigh(matrix, inertia)
        c2 = 1.0 / np.maximum(values, 1.0)
        beside = np.maximum(1.0 - c2, 1.0 / self._frames)
        return (c2 * np.sqrt((1.0 + c2) / (1.0 + 3.0 * c2)) / beside)[:, None] * modes.T


# Rows that the training equations are hashed to, per coordinate of the subspace: several times the
# elements that are chosen, or the factors would fit the hashing and not the equations.
SKETCH = 60
# Elements that may be chosen, at first and at most: neighbours are much alike, and the equations
# of all elements of a large mesh fill the memory.
CANDIDATES, MOST = 5000, 20_000
SEED = 0


def ecsw_elements(
    group: ConstraintGroup,
    columns: Columns,
    training: Sequence[TrainingFrame],
    tolerances: Sequence[float],
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Sampled elements (m,) and their factors xi > 0 (m,) for each tolerance.

    Of a large group a random (seeded) part is eligible, twice as many where these miss a tolerance,
    up to `MOST`; the sum that they have to meet is always that of all elements.

    Parameters
    ----------
    tolerances : relative residuals tau of the training equations at which NNLS stops
    """
    count = CANDIDATES
    while True:
        eligible = _eligible(group.elements, count)
        rows, total = training_equations(group, columns, training, eligible)
        solutions = nnls_path(rows, total, tolerances)
        if count >= min(group.elements, MOST) or _met(rows, total, solutions, tolerances):
            return [(eligible[support], factors) for support, factors in solutions]
        count *= 2


def _eligible(elements: int, count: int) -> np.ndarray:
    if count >= elements:
        return np.arange(elements)
    return np.sort(np.random.default_rng(SEED).choice(elements, count, replace=False))


def _met(
    rows: np.ndarray,
    total: np.ndarray,
    solutions: Sequence[tuple[np.ndarray, np.ndarray]],
    tolerances: Sequence[float],
) -> bool:
    """Whether every solution keeps to its tolerance, but for round-off."""
    left = [np.linalg.norm(rows[:, support] @ x - total) for support, x in solutions]
    allowed = (1.0 + 1e-9) * np.linalg.norm(total) * np.array(tolerances)
    return bool((np.array(left) <= allowed).all())


def training_equations(
    group: ConstraintGroup,
    columns: Columns,
    training: Sequence[TrainingFrame],
    elements: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Training equations of ``elements`` (m, len(elements)) in Fortran order, and all sums (m,).

    For each pair (z, z') of iterates and each coordinate there is one equation,
    g_e = B^T S_e^T w_e (S_e B z' - p_e(B z)), in the norm of A^-1 (see module `training`),
    all together scaled so that the sum of all elements has norm 1. The share of the rest weight is
    one more equation: a group at rest (no force at all) still keeps its stiffness.

    Many equations are hashed to `SKETCH` K rows with random signs (seeded), which keeps norms of
    combinations up to a few per cent (count sketch, Charikar et al. 2002) and never forms an e x e
    matrix.
    """
    strain = np.ascontiguousarray(group.S @ columns.B)
    weighted = strain * group.row_weights[:, None]
    equations = sum(3 * len(frame.measure) * len(frame.pairs) for frame in training)
    size = min(SKETCH * strain.shape[1], equations)
    generator = np.random.default_rng(SEED)
    rows, sums, norm = np.zeros((len(elements), size + 1)), np.zeros(size + 1), 0.0
    shape = (group.elements, group.rows_per_element, -1)
    for measure, frames in _by_measure(training):
        lifted = weighted @ measure.T
        differences, targets = [], []
        for frame in frames:
            group.begin_frame(columns.B @ frame.start)
            for before, after in frame.pairs:
                difference = strain @ after - group.project(columns.B @ before)
                differences.append(difference.reshape(shape)[elements])
                sum_of_all = lifted.T @ difference
                norm += float(np.sum(sum_of_all**2))
                hashed = (
                    generator.integers(size, size=sum_of_all.shape),
                    generator.choice([-1.0, 1.0], size=sum_of_all.shape),
                )
                np.add.at(sums, hashed[0], hashed[1] * sum_of_all)
                targets.append(hashed)
        buckets, signs = (np.stack(part) for part in zip(*targets, strict=True))
        own = np.ascontiguousarray(lifted.reshape(shape)[elements])
        _hash_equations(own, np.stack(differences), buckets, signs, rows)
    if norm > 0.0:
        rows /= np.sqrt(norm)
        sums /= np.sqrt(norm)
    share = group.weights / group.weights.sum()
    rows[:, -1], sums[-1] = share[elements], 1.0
    return rows.T, sums


def _by_measure(
    training: Sequence[TrainingFrame],
) -> Iterator[tuple[np.ndarray, list[TrainingFrame]]]:
    """Frames that follow each other with the same measure, together."""
    for _, frames in groupby(training, key=lambda frame: id(frame.measure)):
        same = list(frames)
        yield same[0].measure, same


@njit(cache=True, error_model="numpy")
def _hash_equations(lifted, differences, buckets, signs, out):
    """Add each element's equations to the rows that they are hashed to.

    lifted : (m, p, K'), differences : (n, m, p, 3), buckets, signs : (n, K', 3), out : (m, size)
    """
    for e in range(out.shape[0]):
        for n in range(differences.shape[0]):
            for k in range(lifted.shape[2]):
                for axis in range(3):
                    value = 0.0
                    for row in range(lifted.shape[1]):
                        value += lifted[e, row, k] * differences[n, e, row, axis]
                    out[e, buckets[n, k, axis]] += signs[n, k, axis] * value
