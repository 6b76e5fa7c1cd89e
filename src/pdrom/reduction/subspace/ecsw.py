"""Energy-conserving sampling and weighting (Farhat et al. 2014) for projective dynamics.

A few elements e with factors xi_e >= 0 represent all: sum_e xi_e g_e ~ sum_e g_e, where g_e is the
contribution of an element to the reduced equations in all training iterates. The reduced problem is
again a projective-dynamics problem, with weights xi_e w_e >= 0. Whatever the factors, its objective
cannot rise in an iteration: they affect the accuracy, not the stability.

Training iterates come from a run in the position subspace q = B z with all projections. One
iteration from z to z', A z' = (M/h^2) s + sum_e B^T S_e^T w_e p_e(B z), with the system matrix A,
masses M and prediction s in coordinates of the subspace and the time step h, can be written as
sum_e g_e = (M/h^2)(s - z') with g_e = B^T S_e^T w_e (S_e B z' - p_e(B z)). Sampled elements whose
factors satisfy sum_e xi_e g_e = sum_e g_e map z to the same z'. The factors are therefore fitted to
the pairs (z, z') of a run, by sparse non-negative least squares, stopped early. A
residual r of the equations changes the next iterate by A^-1 r and raises the iteration's quadratic
objective by 1/2 r^T A^-1 r above its minimum. Residuals are measured by this amount: in the
Euclidean norm stiff coordinates would hide errors of soft ones, which determine the trajectory.
"""

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np
from scipy import linalg

from pdrom.core.errors import SamplingError
from pdrom.model.compiled.functions import compiled
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.interpolation import SubspaceLocalStep
from pdrom.reduction.subspace.space import ReducedSpace, reduced_state


@dataclass(frozen=True)
class TrainingFrame:
    """Iterates of one frame of the training run.

    ``measure`` (K', K) is for residuals r (K,), of which the entries of K - K' fixed coordinates
    do not count: |measure r|^2, J, is r^T A^-1 r with the system matrix A.
    """

    start: np.ndarray  # (K, 3) coordinates at the frame's start, for data computed once per frame
    pairs: np.ndarray  # (n, 2, K, 3) coordinates before and after each iteration
    measure: np.ndarray


Training = Sequence[TrainingFrame]
Choose = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]
"""Function of equations G (m, e), sums b (m,) and a tolerance; it returns indices (n,) of columns
and factors x (n,) >= 0 with G x near b."""


@dataclass(frozen=True)
class Samples:
    """Indices (m,) of sampled elements and the factors (m,) >= 0 that multiply their weights.

    ``residual`` is the relative residual of the training equations; nan for factors not fitted.
    """

    elements: np.ndarray
    factors: np.ndarray
    residual: float = float("nan")


def training_run(
    scene: Scene, columns: Columns, frames: Sequence[int], start: State | None = None
) -> list[TrainingFrame]:
    """Run ``scene`` in a subspace with all projections; return the iterates of ``frames``.

    The run begins at ``start``, a state in coordinates (K, 3), or (None) at the initial state.
    """
    watched = _Watched(scene.groups[0], columns)
    steps = [watched, *(SubspaceLocalStep(group, columns) for group in scene.groups[1:])]
    space = ReducedSpace(scene, columns, [step.matrix for step in steps])
    config, iterates = scene.config, watched.iterates
    loop = Stepper(space, config.time_step, config.count, steps, track_objective=False)
    state = start or reduced_state(scene, columns)
    kept: list[TrainingFrame] = []
    measures: dict[bytes, np.ndarray] = {}
    wanted = {int(frame) for frame in frames}
    for frame in range(max(wanted) + 1):
        iterates.clear()
        fixed = space.fixed(frame, state.positions)[0]
        first = state.positions
        state, _ = loop.step(state, frame)
        if frame in wanted:
            iterates.append(state.positions)
            pairs = np.stack([iterates[:-1], iterates[1:]], axis=1)
            key = fixed.tobytes()
            if key not in measures:
                measures[key] = _measure(space, fixed)
            kept.append(TrainingFrame(first, pairs, measures[key]))
    return kept


class _Watched(SubspaceLocalStep):
    """Local step that records in ``iterates`` the coordinates y at which it is evaluated."""

    def __init__(self, group: ConstraintGroup, columns: Columns) -> None:
        super().__init__(group, columns)
        self.iterates: list[np.ndarray] = []

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        self.iterates.append(y.copy())
        return super().accumulate(y, rhs)


def _measure(space: ReducedSpace, fixed: np.ndarray) -> np.ndarray:
    """Matrix `TrainingFrame.measure` (K', K) for the K' coordinates that are not ``fixed``."""
    size = len(space.matrix)
    free = np.setdiff1d(np.arange(size), fixed)
    root = linalg.cholesky(space.matrix[np.ix_(free, free)], lower=True)
    measure = np.zeros((len(free), size))
    measure[:, free] = linalg.solve_triangular(root, np.eye(len(free)), lower=True)
    return measure


# Training equations are added up at random (hashed) to SKETCH rows per coordinate of the subspace.
# There must be several times more rows than selected elements, or their factors xi would overfit.
SKETCH = 60
# Samples are chosen among CANDIDATES elements, up to MOST if a tolerance is violated: equations of
# all elements of a large mesh would not fit into memory, and neighbouring elements are similar.
CANDIDATES, MOST = 10_000, 20_000
BATCH = 8  # frames whose equations are hashed together
ROUNDOFF = 10.0  # forces up to this multiple of their rounding errors count as none
SEED = 0


def ecsw_elements(
    group: ConstraintGroup,
    columns: Columns,
    training: Training,
    tolerances: Sequence[float],
    choose: Choose | None = None,
) -> list[Samples]:
    """Select elements and their factors xi > 0 for each tolerance.

    A tolerance bounds the relative residual of the training equations, which is computed without
    hashing and stored with the samples. It is larger if even all candidates violate the tolerance.
    A group without any force in the training keeps all elements. In a large group, candidates are a
    random (seeded) subset, which is doubled, up to `MOST`, until all tolerances hold. ``choose``
    replaces the search (see `Choose`).
    """
    count = CANDIDATES

    def residual(elements: np.ndarray, factors: np.ndarray) -> float:
        """Compute the relative residual of the training equations, without hashing."""
        few, vertices = group.restricted(elements, factors)
        kept = _forces(few, np.ascontiguousarray(columns.B[vertices]), training)
        missed = [np.sum((own - sums) ** 2) for (*_, own), sums in zip(kept, totals, strict=True)]
        size = sum(float(np.sum(sums**2)) for sums in totals)
        return float(np.sqrt(sum(missed) / size)) if size else 0.0

    while True:
        eligible = np.arange(group.elements)
        if count < group.elements:
            chosen = np.random.default_rng(SEED).choice(group.elements, count, replace=False)
            eligible = np.sort(chosen)
        rows, sums, totals, force = training_equations(group, columns, training, eligible)
        if not force:
            every = Samples(np.arange(group.elements), np.ones(group.elements), 0.0)
            return [every] * len(tolerances)
        if choose is not None:
            own = [_checked(choose(rows, sums, bound), len(eligible)) for bound in tolerances]
            return [Samples(eligible[at], xi, residual(eligible[at], xi)) for at, xi in own]
        search = _ActiveSet(rows, sums, apart=1)
        found = _search(search, tolerances, lambda at, xi: residual(eligible[at], xi))  # noqa: B023
        met = all(own[2] <= tolerance for own, tolerance in zip(found, tolerances, strict=True))
        if met or count >= min(group.elements, MOST):
            return [Samples(eligible[at], factors, left) for at, factors, left in found]
        count *= 2
        del rows, search  # these are large: free them before the next ones are made


def _checked(chosen: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the result of a `Choose` for ``count`` elements; SamplingError if it is unusable."""
    try:
        at, factors = (np.asarray(part) for part in chosen)
        order = np.argsort(at, kind="stable")
        at, factors = at[order].astype(np.int64, casting="safe"), factors[order].astype(float)
    except (TypeError, ValueError, IndexError) as error:
        raise SamplingError(f"selection: indices and factors are required ({error})") from error
    if not len(at) or at[0] < 0 or at[-1] >= count or (np.diff(at) == 0).any():
        raise SamplingError(f"selection: different indices from 0 to {count - 1} are required")
    if factors.shape != at.shape or not (np.isfinite(factors) & (factors >= 0.0)).all():
        raise SamplingError("selection: a finite factor >= 0 for each index is required")
    return at, factors


def _forces(
    group: ConstraintGroup, rows: np.ndarray, training: Training
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield, for each training frame, the factors of the sum of g_e over a ``group``, and the sum.

    ``rows`` (n, K) are those of the columns B at the group's vertices. Factors are B^T S^T W times
    `TrainingFrame.measure`, transposed, (e p, K'), and S B z' - p(B z) (e p, 3 m) of m iterates.
    """
    group, strain = group.for_run(), np.ascontiguousarray(group.S @ rows)
    project: Callable[[np.ndarray], np.ndarray] = group.project
    if group.local_kernel is not None:  # one kernel for all iterates
        sampler = group.sampler(np.arange(group.elements))
        project = partial(sampler.projections, count=len(strain))
    weighted = strain * group.row_weights[:, None]
    for _, alike in groupby(training, key=lambda frame: id(frame.measure)):
        frames = list(alike)
        lifted = weighted @ frames[0].measure.T
        for frame in frames:
            group.begin_frame(rows @ frame.start)
            # one pass over each large matrix serves all iterates of a frame
            before, after = (np.hstack(list(frame.pairs[:, i])) for i in range(2))
            positions, differences = rows @ before, strain @ after
            for pair in range(0, differences.shape[1], 3):
                at = slice(pair, pair + 3)
                differences[:, at] -= project(np.ascontiguousarray(positions[:, at]))
            yield lifted, differences, lifted.T @ differences


def training_equations(
    group: ConstraintGroup, columns: Columns, training: Training, elements: np.ndarray
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray], bool]:
    """Return the matrix (m, len(elements)) and right-hand sides (m,) that the factors xi_e fit.

    Return also the sums over all elements in each frame, and whether forces exceed rounding errors.

    For each training iterate z, the next one z' and each coordinate, a row of the matrix has entry
    g_e, times `TrainingFrame.measure`. Right-hand sides are sums over all elements, scaled to norm
    1 with the rows. The last row has the shares of the total weight, so that a group with small
    forces keeps its stiffness. The matrix is in Fortran order.

    The equations are hashed to at most `SKETCH` K rows (B has K columns) with seeded random signs,
    which changes norms of residuals by a few per cent (count sketch, Charikar et al. 2002).
    """
    equations = sum(3 * len(frame.measure) * len(frame.pairs) for frame in training)
    size = min(SKETCH * columns.B.shape[1], equations)
    generator = np.random.default_rng(SEED)
    rows, sums, norm = np.zeros((len(elements), size + 1)), np.zeros(size + 1), 0.0
    shape, totals, force = (group.elements, group.rows_per_element, -1), list[np.ndarray](), False
    made = enumerate(zip(training, _forces(group, columns.B, training), strict=True))
    for _, batch in groupby(made, key=lambda own: (own[0] // BATCH, id(own[1][0].measure))):
        parts = []
        for _, (frame, (lifted, differences, sums_of_all)) in batch:
            totals.append(sums_of_all)
            if not force:
                noise = group.roundoff(columns.B @ frame.start) * np.sqrt(len(frame.pairs))
                force = float(np.linalg.norm(differences)) > ROUNDOFF * noise
            norm += float(np.sum(sums_of_all**2))
            entries = lifted.shape[1], 3
            drawn = [
                (generator.integers(size, size=entries), generator.choice([-1.0, 1.0], entries))
                for _ in range(differences.shape[1] // 3)
            ]
            buckets, signs = (np.hstack(part) for part in zip(*drawn, strict=True))
            np.add.at(sums, buckets, signs * sums_of_all)
            parts.append((differences.reshape(shape)[elements], buckets.astype(np.uint32), signs))
        ends = np.cumsum([own.shape[1] for *_, own in parts])
        factors = np.ascontiguousarray(lifted.reshape(shape)[elements])
        whole = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
        _hash_equations(factors, *whole, ends, rows)
    if norm > 0.0:
        rows /= np.sqrt(norm)
        sums /= np.sqrt(norm)
    share = group.weights / group.weights.sum()
    rows[:, -1], sums[-1] = share[elements], 1.0
    return rows.T, sums, totals, force


@compiled
def _hash_equations(lifted, differences, buckets, signs, ends, out):
    """Add the equations of each element to the rows ``buckets`` of ``out``, times ``signs``.

    Equation (k, n) of element e is the product of lifted[e, :, k] and differences[e, :, n]. Shapes:
    lifted (m, p, K'), differences (m, p, n), buckets and signs (K', n), out (m, size). ``ends`` are
    the last n of each frame, exclusive. Frames are in the inner loop, as ``out`` exceeds the cache.
    """
    values = np.empty(differences.shape[2])
    for e in range(out.shape[0]):
        first = 0
        for last in ends:
            for k in range(lifted.shape[2]):
                values[first:last] = 0.0
                for row in range(lifted.shape[1]):
                    factor = lifted[e, row, k]
                    for n in range(first, last):
                        values[n] += factor * differences[e, row, n]
                for n in range(first, last):
                    out[e, buckets[k, n]] += signs[k, n] * values[n]
            first = last


log = logging.getLogger(__name__)

# A unit column depends on the active columns if its part orthogonal to them is shorter than this.
DEPENDENT = 1e-7
# Columns of G are added at once if their correlation with the residual is at least CLOSE times the
# largest correlation, at most 1 + BLOCK n at a time if n columns are active already.
CLOSE = 0.7
BLOCK = 0.2


Found = tuple[np.ndarray, np.ndarray, float]


def _search(
    search: "_ActiveSet", tolerances: Sequence[float], residual: Callable[..., float]
) -> list[Found]:
    """Continue ``search`` until the ``residual`` of its solution is within each tolerance."""
    found: dict[float, Found] = {}
    for tolerance in sorted(set(tolerances), reverse=True):
        aim = tolerance
        while search.reach(aim):
            left = residual(*search.solution())
            if left <= tolerance or aim == 0.0:
                break
            # the residual of the hashed equations is slightly smaller than that of all equations
            aim = min(aim, search.relative_residual) * max(0.5, min(0.9, tolerance / left))
        else:
            left = residual(*search.solution())
        found[tolerance] = *search.solution(), left
        missed = found[tolerance][2] > tolerance > 0.0
        log.log(
            logging.WARNING if missed else logging.INFO,
            "sampling: %d elements, residual %.2e%s",
            len(found[tolerance][0]), found[tolerance][2],
            f", which violates the tolerance {tolerance:g}" if missed else "",
        )  # fmt: skip
    return [found[tolerance] for tolerance in tolerances]


class _ActiveSet:
    """Search for a sparse x >= 0 with G x near b: active columns of G, and their factors.

    In the active-set method of Lawson and Hanson, the column with the largest correlation with the
    residual is added, the least-squares problem of the active columns is solved, and columns whose
    values would be negative are removed. If many columns are active, several are added at a time,
    to save passes over G, unless all columns added last were removed again. The updated
    Cholesky factor of the normal equations suffices for relative residuals down to about 1e-6.
    """

    def __init__(self, g: np.ndarray, b: np.ndarray, apart: int = 0) -> None:
        """Search with ``g`` (m, e), in Fortran order for speed, and ``b`` (m,).

        The last ``apart`` rows have a separate relative residual; the larger residual counts.
        """
        self._g, self._b, self._size = g, b, float(np.linalg.norm(b))
        parts = slice(len(b) - apart), slice(len(b) - apart, None)
        sizes = [float(np.linalg.norm(b[part])) for part in parts]
        self._parts = [(part, size) for part, size in zip(parts, sizes, strict=True) if size]
        norms, self._most = np.sqrt(np.einsum("ij,ij->j", g, g)), min(g.shape)
        self._banned = norms == 0.0
        self._norms = np.where(self._banned, 1.0, norms)
        self._columns = np.empty((len(b), self._most), order="F")
        self._factor = np.zeros((self._most, self._most), order="F")
        self._target = np.empty(self._most)
        self._active: list[int] = []
        self._values = np.zeros(0)
        self._residual = b  # b - G x, (m,)
        self._alone = False

    @property
    def relative_residual(self) -> float:
        """Relative residual || G x - b || / || b ||; 0 if b = 0."""
        residuals = ((self._residual[part], size) for part, size in self._parts)
        found = (float(np.linalg.norm(own)) / size for own, size in residuals)
        return max(found, default=0.0)

    def solution(self) -> tuple[np.ndarray, np.ndarray]:
        """Return active columns of G, ascending, and their entries of x (in G x near b)."""
        order = np.argsort(self._active)
        active = np.array(self._active, dtype=np.int64)[order]
        return active, self._values[order] / self._norms[active]

    def reach(self, tolerance: float) -> bool:
        """Activate columns of G until `relative_residual` <= ``tolerance``; return success."""
        while self.relative_residual > tolerance and len(self._active) < self._most:
            block = self._choose()
            if len(block) == 0:
                return False
            joined = [int(c) for c in block if self._add(int(c))]
            if joined:
                self._solve()
                self._residual = self._b - self._columns[:, : len(self._active)] @ self._values
            staying = set(self._active).intersection(joined)
            # exclude a column that `_add` or `_solve` rejected when it was added alone
            if len(block) == 1 and not staying:
                self._banned[block] = True
            self._alone = not staying and len(block) > 1
        return self.relative_residual <= tolerance

    def _choose(self) -> np.ndarray:
        """Indices of columns most correlated with the residual, the best first; may be empty."""
        gradient = (self._residual @ self._g) / self._norms
        gradient[self._active] = -np.inf
        gradient[self._banned] = -np.inf
        best = float(gradient.max())
        if not best > 1e-12 * self._size:
            return np.empty(0, dtype=np.int64)
        room = self._most - len(self._active)
        count = 1 if self._alone else min(room, 1 + int(BLOCK * len(self._active)))
        if count == 1:
            return np.array([np.argmax(gradient)])
        first = np.argpartition(-gradient, min(count, len(gradient) - 1))[:count]
        first = first[gradient[first] >= CLOSE * best]
        return first[np.argsort(-gradient[first], kind="stable")]

    def _add(self, column: int) -> bool:
        """Activate a column if it is linearly independent of the active columns; return whether."""
        n, new = len(self._active), self._g[:, column] / self._norms[column]
        cross = self._forward(self._columns[:, :n].T @ new)
        rest = float(new @ new - cross @ cross)
        if rest <= DEPENDENT**2:
            return False
        self._columns[:, n] = new
        self._factor[n, :n], self._factor[n, n] = cross, np.sqrt(rest)
        self._target[n] = new @ self._b
        self._active.append(column)
        self._values = np.append(self._values, 0.0)
        return True

    def _solve(self) -> None:
        """Solve least squares with the active columns of G; deactivate those with values <= 0."""
        while self._active:
            n = len(self._active)
            half = self._forward(self._target[:n])
            z = linalg.solve_triangular(
                self._factor[:n, :n], half, lower=True, trans="T", check_finite=False
            )
            if (z > 0.0).all():
                self._values = z
                return
            negative = z <= 0.0
            x = self._values
            step = np.min(x[negative] / (x[negative] - z[negative]))
            x = x + step * (z - x)
            keep = ~negative | (x > 1e-14 * max(float(np.abs(x).max()), np.finfo(float).tiny))
            if keep.all():
                keep[np.argmin(np.where(negative, x, np.inf))] = False
            self._keep(keep, x)

    def _forward(self, rhs: np.ndarray) -> np.ndarray:
        n = len(rhs)
        if n == 0:
            return rhs
        return linalg.solve_triangular(self._factor[:n, :n], rhs, lower=True, check_finite=False)

    def _keep(self, keep: np.ndarray, x: np.ndarray) -> None:
        """Keep active columns where ``keep`` is True; ``x``: values of all columns now active."""
        kept = np.flatnonzero(keep)
        size, n = len(self._active), len(kept)
        first = int(np.flatnonzero(~keep)[0])
        self._columns[:, first:n] = self._columns[:, kept[first:]]
        self._target[:n] = self._target[kept]
        self._active = [self._active[i] for i in kept]
        self._values = x[kept]
        for column in np.flatnonzero(~keep)[::-1]:
            _remove_row(self._factor, size, int(column))
            size -= 1


@compiled
def _remove_row(factor, n, column):
    """Update the Cholesky ``factor`` (n, n) of a matrix that loses its row and column ``column``.

    The removed column is added to the part of the factor below by a rank-one update (Gill, Golub,
    Murray, Saunders 1974, method C1).
    """
    lost = factor[column + 1 : n, column].copy()
    for j in range(column, n - 1):
        for i in range(j, n - 1):
            factor[i, j] = factor[i + 1, j + 1]
    for j in range(column):
        for i in range(column, n - 1):
            factor[i, j] = factor[i + 1, j]
    for j in range(column, n - 1):
        v = lost[j - column]
        diagonal = factor[j, j]
        radius = np.sqrt(diagonal * diagonal + v * v)
        c, s = radius / diagonal, v / diagonal
        factor[j, j] = radius
        for i in range(j + 1, n - 1):
            value = (factor[i, j] + s * lost[i - column]) / c
            lost[i - column] = c * lost[i - column] - s * value
            factor[i, j] = value
