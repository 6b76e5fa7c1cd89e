"""Methods beside the plain and the accelerated local/global iteration, with substeps of a frame.

They are explicit integration, and K local/global iterations of each substep: by Chebyshev's
semi-iteration (Wang 2015, alg. 1), or with Anderson acceleration and a coarse level.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import linalg, sparse

from pdrom.core.errors import SceneError
from pdrom.model.compiled.arithmetic import add, add_scaled, constant
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import WIDTH, at, load, store, unflat, write
from pdrom.model.constraints.local_kernel import add_all, table_of
from pdrom.model.dynamics.acceleration import Anderson, combine, forget, refuse
from pdrom.model.dynamics.frames import inertia_energy, weighted
from pdrom.model.dynamics.sweeps import sweep
from pdrom.model.runs import followed
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.ecsw import Samples
from pdrom.reduction.subspace.model import SubspaceModel
from study.experiments.alternatives.solvers.substeps import (
    Alternative,
    Substeps,
    begin,
    end,
)

WINDOW = 5  # number of earlier iterates in Anderson acceleration, as in Peng et al. 2018
# Parameters of Chebyshev's semi-iteration: convergence rate of the plain iteration, and largest
# number of plain iterations before the first extrapolation. Both are set by hand, as in Wang 2015.
# Of five rates, this one is best in both of the compared scenes with a sheet: choosing it favours
# this method.
RATE = 0.98
PLAIN = 5
POWER = 100  # plain iterations after which two changes tell a rate


def measured_rate(scene: Scene) -> float:
    """Convergence rate of the plain iteration in the first frame, by power iteration."""
    loop, start = scene.iterated(POWER).stepper(track_objective=False), scene.initial_state()
    ends = []
    for count in range(POWER, POWER + 3):
        loop.iterations = count
        ends.append(loop.step(start, 0)[0].positions)
    last, change = (float(np.linalg.norm(b - a)) for a, b in pairwise(ends))
    return min(change / last, 1.0) if last > 0.0 else 0.0


class Chebyshev(Alternative):
    """Chebyshev's semi-iteration, which extrapolates each iterate from the one before the last.

    The first extrapolation follows `PLAIN` plain iterations, or a third of all.
    """

    name = "chebyshev"
    rate = RATE

    def _advance(self, part: Substeps) -> None:
        plain, inertia = min(PLAIN, self.iterations // 3), self.space.system.inertia
        _chebyshev(*part, inertia, self.table, self._factor(part), self.rate, plain)


@compiled(nogil=True)
def _chebyshev(
    y, v, acceleration, step, substeps, iterations, fixed, targets, inertia, table, factor, rate,
    plain,
):  # fmt: skip
    panels, vertices, loads, work = factor
    before, s, rhs = np.empty(len(y)), np.empty(len(y)), np.empty(len(y))
    last, image = np.empty(len(y)), np.empty(len(y))
    for _ in range(substeps):
        begin(y, v, acceleration, step, fixed, targets, before, s)
        base = weighted(inertia, s)
        weight = 1.0
        write(y, last)
        for k in range(iterations):
            write(base, rhs)
            add_all(table, y, rhs)
            write(y, image)
            sweep(panels, vertices, loads, work, rhs, image)
            if k == plain:
                weight = 2.0 / (2.0 - rate * rate)
            elif k > plain:
                weight = 4.0 / (4.0 - rate * rate * weight)
            for j in range(len(y)):
                held = y[j]
                y[j] = weight * (image[j] - last[j]) + last[j]
                last[j] = held
        end(y, before, step, v)


INNER = 10  # number of coarse-level iterations (Anderson acceleration) in each iteration


class TwoLevel(Alternative):
    """Anderson acceleration with a coarse level: the position subspace of a ``model`` of the scene.

    The plain iteration converges slowly for deformations that are stiff in the system matrix A and
    soft in the objective. Its result G(y) is therefore corrected in the span of the columns V of
    the subspace, scaled to V^T A V = 1. The component V g, g = V^T A (G(y) - y), of the step from y
    to G(y) is replaced by V z, where z minimises the objective of y + V z, with sampled elements
    in place of all. This is the full approximation scheme (Brandt 1977) with one additive
    smoothing step: -g is the exact gradient in the span, so that z = g = 0 where y minimises the
    frame's objective, whatever elements are sampled. The corrected iteration is accelerated. An
    iterate that raises the objective is replaced by the last G(y) without correction.

    Raises SceneError if the scene has several groups, or if `Alternative` refuses it.
    """

    name = "two-level"

    def __init__(self, scene: Scene, substeps: int, iterations: int, model: SubspaceModel) -> None:
        self._model = model
        super().__init__(scene, substeps, iterations)

    def _prepare(self, scene: Scene) -> None:
        if len(scene.groups) != 1:
            raise SceneError(f"scene '{scene.config.name}': method '{self.name}' takes one group")
        columns, group = self._model.columns, scene.groups[0]
        system = self.space.system
        # leave out the columns of vertices that are fixed in any frame: y is not corrected there
        free = columns.B[:, columns.free]
        image = system.matrix @ free
        factor = linalg.cholesky(free.T @ image, lower=True)
        span, image = (linalg.solve_triangular(factor, a.T, lower=True) for a in (free, image))
        chosen = self._model.samples[group.name]
        assert isinstance(chosen, Samples)
        self._group, self._vertices = group.restricted(chosen.elements, chosen.factors)
        rows = span[:, self._vertices].T
        inertia = (span * (scene.masses / self.time_step**2)) @ span.T
        inverse = linalg.inv(inertia + rows.T @ (self._group.system_matrix() @ rows))
        assert self._group.local_kernel is not None
        self._sampled = table_of([self._group.local_kernel])
        self._matrices = tuple(
            np.ascontiguousarray(m) for m in (span.T, image, rows, inverse @ rows.T, inverse)
        )
        self._history, self._inner = Anderson(WINDOW), Anderson(WINDOW)
        self._inner.begin_frame(np.zeros((len(span), WIDTH)))

    def _advance(self, part: Substeps) -> None:
        y = unflat(part.y)
        self._history.begin_frame(part.y.reshape(-1, WIDTH))
        self._group.begin_frame(y[self._vertices])
        coarse = (*self._matrices, self._vertices, self._sampled, self._inner.history)
        inertia = self.space.system.inertia
        _two_level(*part, inertia, self.table, self._factor(part), self._history.history, coarse)


@compiled(nogil=True)
def _two_level(
    y, v, acceleration, step, substeps, iterations, fixed, targets, inertia, table, factor,
    history, coarse,
):  # fmt: skip
    panels, vertices, loads, work = factor
    before, s, rhs = np.empty(len(y)), np.empty(len(y)), np.empty(len(y))
    plain = np.empty(len(y))
    for _ in range(substeps):
        begin(y, v, acceleration, step, fixed, targets, before, s)
        base = weighted(inertia, s)
        forget(history)
        for k in range(iterations):
            write(base, rhs)
            objective = add_all(table, y, rhs) + inertia_energy(y, s, inertia)
            # 0: test also the iterate after the first correction, which may raise the objective
            if refuse(history, y, objective, 0):
                write(plain, y)
                continue
            sweep(panels, vertices, loads, work, rhs, y)
            if k < iterations - 1:
                write(y, plain)
                _correct(coarse, history[0], y)
                combine(history, y)
        end(y, before, step, v)


@inner
def _correct(coarse, start, image):
    """Correct ``image`` = G(y) on the ``coarse`` level, as in `TwoLevel`; ``start`` is y."""
    span, duals, rows, steps, inverse, vertices, table, history = coarse
    size, sampled = WIDTH * span.shape[1], WIDTH * len(vertices)
    step, x, at_start = np.zeros(size), np.empty(sampled), np.zeros(sampled)
    _add_product(duals, image - start, step)
    for i in range(len(vertices)):
        store(x, WIDTH * i, load(start, WIDTH * vertices[i]))
    add_all(table, x, at_start)
    first, z, moved, forces = np.zeros(size), np.empty(size), np.empty(sampled), np.empty(sampled)
    _add_product(inverse, step, first)
    write(first, z)
    forget(history)
    for _ in range(INNER):
        refuse(history, z, np.nan)  # with nan as objective, which is unknown, no iterate is refused
        for i in range(sampled):
            moved[i], forces[i] = x[i], 0.0
        _add_product(rows, z, moved)
        add_all(table, moved, forces)
        for i in range(sampled):
            forces[i] -= at_start[i]
        write(first, z)
        _add_product(steps, forces, z)
        combine(history, z)
    z -= step
    _add_product(span, z, image)


@inner
def _add_product(matrix, x, out):
    """Add ``matrix`` (m, n) times ``x`` (n, 4) to ``out`` (m, 4); both are flat arrays."""
    m, n = matrix.shape
    numbers = matrix.reshape(-1)
    for i in range(m):
        # two independent sums, which the processor can compute in parallel
        even, odd = load(out, WIDTH * i), constant(0.0)
        for k in range(0, n - 1, 2):
            even = add_scaled(even, at(numbers, n * i + k), load(x, WIDTH * k))
            odd = add_scaled(odd, at(numbers, n * i + k + 1), load(x, WIDTH * (k + 1)))
        if n % 2:
            even = add_scaled(even, at(numbers, n * i + n - 1), load(x, WIDTH * (n - 1)))
        store(out, WIDTH * i, add(even, odd))


UNSTABLE = 1e100  # a run with larger coordinates (m), or with values not finite, was unstable


class Explicit(Alternative):
    """Explicit integration by position Verlet; ``iterations`` are ignored.

    A substep advances positions over half its time, then velocities over its whole time, and then
    positions over the other half. The method is symplectic and of second order (Tuckerman et al.
    1992), with one evaluation of forces per substep. It is stable if the substep is shorter than
    2 / omega, where omega is the angular frequency of the stiffest mode.
    """

    name = "explicit"

    def _prepare(self, scene: Scene) -> None:
        total = sparse.csr_array((len(self.masses), len(self.masses)))
        for group in scene.groups:
            total = total + group.system_matrix()
        total.sort_indices()
        # stiffness matrix, the sum of S^T W S over all groups, as CSR arrays for `_multiply`
        self._stiffness = *(i.astype(np.int32) for i in (total.indptr, total.indices)), total.data

    def _advance(self, part: Substeps) -> None:
        rows, fixed = part.y.reshape(-1, WIDTH), part.fixed
        speed = (part.targets - rows[fixed, :3]) / (part.substeps * part.time_step)
        part.v.reshape(-1, WIDTH)[fixed, :3] = speed
        inverse = 1.0 / self.masses
        inverse[fixed] = 0.0  # fixed vertices are not accelerated
        _explicit(*part[:5], inverse, self.table, self._stiffness)
        rows[fixed, :3] = part.targets


@compiled(nogil=True)
def _explicit(y, v, acceleration, step, substeps, inverse, table, stiffness):
    pull, elastic = np.empty(len(y)), np.empty(len(y))
    for _ in range(substeps):
        for k in range(len(y)):
            y[k] += 0.5 * step * v[k]
            pull[k] = 0.0
        add_all(table, y, pull)
        _multiply(stiffness, y, elastic)
        for i in range(len(inverse)):
            if inverse[i] > 0.0:
                for axis in range(3):
                    k = WIDTH * i + axis
                    force = pull[k] - elastic[k]
                    v[k] += step * (acceleration[axis] + inverse[i] * force)
        for k in range(len(y)):
            y[k] += 0.5 * step * v[k]


@inner
def _multiply(matrix, y, out):
    """Write ``matrix`` (N, N; CSR) times ``y`` (N, 4) to ``out`` (N, 4); both are flat arrays."""
    indptr, indices, data = matrix
    for i in range(len(indptr) - 1):
        total = constant(0.0)
        for k in range(at(indptr, i), at(indptr, i + 1)):
            total = add_scaled(total, at(data, k), load(y, WIDTH * at(indices, k)))
        store(out, WIDTH * i, total)


@dataclass(frozen=True)
class Continuous:
    """Motion in continuous time, as computed by `continuous`.

    positions : (F + 1, N, 3) m, initial positions Q_0, then positions at the ends of frames
    error : estimate of || Q - Q_exact || / || Q - Q_0 ||, from the last halving of the step
    substeps : number of explicit steps of a frame
    """

    positions: np.ndarray
    error: float
    substeps: int


def continuous(
    scene: Scene, frames: int, tolerance: float, substeps: int, limit: int
) -> Continuous:
    """Run ``frames`` of ``scene`` by explicit steps, halving the step until the error is small.

    tolerance : estimated relative error that ends the halving
    substeps : number of substeps of a frame in the first run
    limit : largest number of substeps of a frame; the last run is returned, whatever its error
    """
    start, before, last = scene.initial_state(), None, np.inf
    while True:
        after = followed(Explicit(scene, substeps), start, frames)
        if before is not None:
            change = _change(before, after)
            # Richardson's estimate of the remaining error. With each halving of the step, changes
            # of a method of second order fall to a quarter; a third of the last change then
            # remains. If changes do not even fall to a half, the motion is not smooth or not yet
            # resolved, and the estimate is the whole change.
            ratio = last / change if change > 0.0 and np.isfinite(last) else 1.0
            error = change / min(max(ratio - 1.0, 1.0), 3.0)
            if error <= tolerance or 2 * substeps > limit:
                return Continuous(after, error, substeps)
            last = change
        before, substeps = after, 2 * substeps


def _change(before: np.ndarray, after: np.ndarray) -> float:
    """Norm of the difference of two runs / norm of the motion in ``after``; inf if unstable."""
    if not max(np.abs(before).max(), np.abs(after).max()) < UNSTABLE:
        return float("inf")
    difference, moved = np.linalg.norm(after - before), np.linalg.norm(after - after[0])
    return float(difference / moved) if moved > 0.0 else 0.0
