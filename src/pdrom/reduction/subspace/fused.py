"""Iterations and frames of a subspace model in one compiled loop over the sampled elements.

In the K' coordinates z of a position subspace that are not fixed, one iteration is

    d = D z + d_0        S q of the m sampled elements, d_0 from the fixed coordinates
    p = p(d)             projections
    z = c + L^T p        global step, with c = A^-1 (M/h^2 s - load) and L = W D A^-1

D and L are (m p, K') for p rows per element, load is due to the fixed coordinates. An iteration has
two small dense products and the projections; it allocates nothing, and no array grows with the
mesh. If no group has data that are computed once per frame, c is the product of a matrix with s,
whose fixed coordinates are set to their targets, and one compiled call computes many frames, up to
the first in which a vertex is below a floor.

The matrix of a product is stored in blocks of `TALL` rows, each block column by column, so that the
sums of all rows of a block are computed side by side. Vectors are stored as three numbers each, but
read and written four numbers at a time; their arrays have space for the additional numbers
(`vectors`). Every sum is in the order of the columns on all processors.
"""

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from pdrom.model.compiled.arithmetic import add_scaled
from pdrom.model.compiled.functions import clock, compiled, inner, now
from pdrom.model.compiled.rows import WIDTH, at, copied, load, store, zeros
from pdrom.model.compiled.rows import write as copy
from pdrom.model.constraints.local_kernel import call_gradients
from pdrom.model.dynamics.acceleration import NO_HISTORY, Anderson, History, combine, forget, refuse
from pdrom.model.dynamics.frames import BLOCK, Blocks
from pdrom.model.dynamics.space import Solve
from pdrom.model.dynamics.stepper import LocalStep, Observer, Stepper
from pdrom.model.effects.base import Anchors
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.interpolation import SubspaceLocalStep
from pdrom.reduction.subspace.space import DenseElimination, ReducedSpace


class FusedStepper(Stepper):
    """Step loop with compiled, fused iterations; results equal those of `Stepper` up to round-off.

    The whole time of iterations counts as that of the local step. If a local step is no
    `SubspaceLocalStep` or a group has no `gradient_kernel`, this class iterates like `Stepper`.
    """

    def __init__(self, scene: Scene, space: ReducedSpace, local_steps: Sequence[LocalStep]) -> None:
        config, acceleration = scene.config, scene.acceleration()
        h, iterations = config.time_step, config.iterations
        super().__init__(space, h, iterations, local_steps, False, acceleration)
        self._fused: _Fused | None = None
        steps = [step for step in self.local_steps if isinstance(step, SubspaceLocalStep)]
        kernels = [step.group.gradient_kernel for step in steps]
        if len(steps) == len(local_steps) and None not in kernels:
            self._fused = _Fused(space, _Sampled(steps), acceleration)
            if space.whole_frames and not any(step.group.frame_lagged for step in steps):
                self._whole = self._fused

    def _iterate(
        self, s: np.ndarray, base: np.ndarray, system: Solve, seconds: np.ndarray, watch: Observer
    ) -> tuple[np.ndarray, np.ndarray]:
        if self._fused is None or watch is not None or not isinstance(system, DenseElimination):
            return super()._iterate(s, base, system, seconds, watch)
        before = perf_counter()
        y = self._fused.iterate(system, s, base, self.iterations)
        seconds[1] += perf_counter() - before
        return y, np.empty(0)


class _Fused:
    """Compiled code for iterations and frames, with matrices per set of prescribed coordinates."""

    def __init__(
        self, space: ReducedSpace, sampled: "_Sampled", acceleration: Anderson | None
    ) -> None:
        self._space, self._sampled, self._acceleration = space, sampled, acceleration
        self._operators: dict[int, _Operators] = {}
        self._clock = clock()
        self._waiting = 0

    def _of(self, elimination: DenseElimination) -> "_Operators":
        # the id is a unique key, since the space keeps all its reduced systems (eliminations)
        key = id(elimination)
        if key not in self._operators:
            inertia = self._space.inertia_matrix
            self._operators[key] = _Operators(self._sampled, elimination, inertia)
        return self._operators[key]

    def iterate(
        self, elimination: DenseElimination, s: np.ndarray, base: np.ndarray, iterations: int
    ) -> np.ndarray:
        """Coordinates (K, 3) after a frame's iterations from prediction s; ``base``: (M/h^2) s."""
        own, sampled, free = self._of(elimination), self._sampled, elimination.free
        sampled.refresh()
        targets = vectors(len(elimination.fixed))
        targets[: elimination.targets.size] = elimination.targets.ravel()
        product(own.coupling, own.rows, len(elimination.fixed), own.nothing, targets, own.offset)
        count = 3 * len(free)
        own.constant[:count] = elimination.solved(base).ravel()
        own.z[:count] = s[free].ravel()
        run_iterations(
            iterations, len(free), own.rows, own.iterated, sampled.arrays, self._history(free)
        )
        y = s.copy()
        y[free] = own.z[:count].reshape(-1, 3)
        return y

    def _history(self, free: np.ndarray) -> History | None:
        """Empty history of Anderson acceleration for ``free`` coordinates; None if unused."""
        if self._acceleration is None:
            return NO_HISTORY
        self._acceleration.begin_frame(np.empty((len(free), 3)))
        return self._acceleration.history

    def run(
        self, q: np.ndarray, v: np.ndarray, frames: range, h: float, iterations: int, track: bool,
        anchors: Anchors,
    ) -> Blocks | None:  # fmt: skip
        """Compute as many of ``frames`` in turn as one compiled call can; ``track`` is ignored.

        Return None if the body touches a floor in the first frame, and also in the next `BLOCK` - 1
        calls, as contacts last. In both cases, the caller computes one frame by `iterate`.
        """
        if self._waiting and frames.start:
            self._waiting -= 1
            return None
        fixed, targets, anchors = self._space.held_path(frames[:BLOCK], q, anchors)
        elimination = self._space.elimination(fixed)
        own, count = self._of(elimination), len(targets)
        positions, velocities = np.empty((2, count + 1, *q.shape))
        positions[0], velocities[0] = q, v
        seconds = np.zeros((count, 4))
        run_frames(
            positions, velocities, *self._space.affine, h, elimination.fixed, elimination.free,
            targets, own.begun, iterations, own.rows, own.iterated, self._sampled.arrays,
            self._history(elimination.free), seconds, self._clock,
        )  # fmt: skip
        free = self._space.free_frames(positions[1:])
        if free == 0:
            self._waiting = BLOCK - 1
            return None
        done = slice(1, free + 1)
        return (positions[done], velocities[done], np.empty((free, 0)), seconds[:free]), anchors


class _Sampled:
    """Arrays of the sampled elements of all groups, one group after the other."""

    def __init__(self, steps: Sequence[SubspaceLocalStep]) -> None:
        groups = [step.group for step in steps]
        self._groups = groups
        self.strain = np.vstack([step.strain for step in steps])
        self.row_weights = np.concatenate([group.row_weights for group in groups])
        rows = [group.elements * group.rows_per_element for group in groups]
        parts = [group.kernel_parameters().ravel() for group in groups]
        self._starts = np.concatenate([[0], np.cumsum([len(part) for part in parts])])
        self._parameters = np.concatenate(parts)
        self._lagged = [i for i, group in enumerate(groups) if group.frame_lagged]
        self.arrays = (
            np.array([group.gradient_kernel.address for group in groups]),
            np.array([group.elements for group in groups]),
            np.concatenate([[0], np.cumsum(rows)]),
            self._parameters,
            self._starts,
            vectors(len(self.strain)),
            vectors(len(self.strain)),
        )
        """Groups: kernel addresses, elements, first rows, parameters and their starts; S q; p."""

    def refresh(self) -> None:
        """Copy to `arrays` the parameters that groups have computed at the frame's beginning."""
        for i in self._lagged:
            start, stop = self._starts[i : i + 2]
            self._parameters[start:stop] = self._groups[i].kernel_parameters().ravel()


class _Operators:
    """Matrices and vectors of an iteration, for one set of subspace coordinates that are fixed.

    iterated : D, L^T, d_0, c, z of the module's docstring; row weights, M/h^2 of free coordinates
        and working memory, for the objective
    begun : matrices that map s to c and fixed coordinates to d_0, zeros, arrays for these inputs
    """

    def __init__(
        self, sampled: _Sampled, elimination: DenseElimination, inertia: np.ndarray
    ) -> None:
        strain, free, fixed = sampled.strain, elimination.free, elimination.fixed
        self.rows = len(strain)
        lift = elimination.lift(sampled.row_weights[:, None] * strain)
        self.offset, self.constant, self.z = (vectors(n) for n in (self.rows, *[len(free)] * 2))
        self.nothing = vectors(max(len(inertia), self.rows))
        self.coupling = blocks(strain[:, fixed])
        self.iterated = (
            blocks(strain[:, free]), blocks(lift.T), self.offset, self.constant, self.z,
            sampled.row_weights, np.ascontiguousarray(inertia[np.ix_(free, free)]),
            np.empty(3 * len(free)),
        )  # fmt: skip
        response = blocks(elimination.response(inertia))
        self.begun = (
            response, self.coupling, self.nothing, vectors(len(inertia)), vectors(len(fixed))
        )  # fmt: skip


TALL = 8


def blocks(matrix: np.ndarray) -> np.ndarray:
    """Arrange ``matrix`` (m, n) in blocks for `product`, flat; zero rows fill the last block."""
    m, n = matrix.shape
    whole = np.zeros((-(-m // TALL) * TALL, n))
    whole[:m] = matrix
    return copied(
        np.ascontiguousarray(whole.reshape(len(whole) // TALL, TALL, n).transpose(0, 2, 1)).ravel()
    )


def vectors(count: int) -> np.ndarray:
    """Flat array of zeros for ``count`` vectors of three numbers, padded as `product` requires."""
    return zeros(3 * (-(-count // TALL) * TALL) + WIDTH)


@compiled(nogil=True)
def product(matrix, m, n, start, x, out):
    """Set ``out`` = ``start`` + M ``x``; M (m, n) comes from `blocks`, arrays from `vectors`."""
    entry = 0
    for row in range(0, 3 * m, 3 * TALL):
        a, b = load(start, row), load(start, row + 3)
        c, d = load(start, row + 6), load(start, row + 9)
        e, f = load(start, row + 12), load(start, row + 15)
        g, h = load(start, row + 18), load(start, row + 21)
        for k in range(0, 3 * n, 3):
            v = load(x, k)
            a, b = add_scaled(a, at(matrix, entry), v), add_scaled(b, at(matrix, entry + 1), v)
            c, d = add_scaled(c, at(matrix, entry + 2), v), add_scaled(d, at(matrix, entry + 3), v)
            e, f = add_scaled(e, at(matrix, entry + 4), v), add_scaled(f, at(matrix, entry + 5), v)
            g, h = add_scaled(g, at(matrix, entry + 6), v), add_scaled(h, at(matrix, entry + 7), v)
            entry += TALL
        # the fourth number stored for each vector is overwritten by the next vector
        store(out, row, a)
        store(out, row + 3, b)
        store(out, row + 6, c)
        store(out, row + 9, d)
        store(out, row + 12, e)
        store(out, row + 15, f)
        store(out, row + 18, g)
        store(out, row + 21, h)


@compiled(nogil=True)
def run_iterations(count, size, rows, operators, sampled, history):
    """Do ``count`` iterations that change ``size`` free subspace coordinates z in place.

    rows : number of rows of all sampled elements
    operators : matrices and vectors `_Operators.iterated`, z among them
    sampled : data of the sampled elements, `_Sampled.arrays`
    history : arrays of Anderson acceleration, see `Anderson`; `NO_HISTORY` without it
    """
    strain, lift, offset, constant, z, weights, inertia, start = operators
    addresses, elements, starts, parameters, parameter_starts, d, p = sampled
    y = z[: 3 * size]
    if history is not None:
        copy(y, start)
        forget(history)
    for k in range(count):
        product(strain, rows, size, offset, z, d)
        for g in range(len(addresses)):
            call_gradients(
                addresses[g],
                d[3 * starts[g] :].ctypes.data,
                parameters[parameter_starts[g] :].ctypes.data,
                p[3 * starts[g] :].ctypes.data,
                elements[g],
            )
        refused = False
        if history is not None:
            refused = refuse(history, y, _objective(weights, d, p, inertia, y, start))
        if not refused:
            product(lift, size, rows, constant, p, z)
            if history is not None and k < count - 1:
                combine(history, y)


@inner
def _objective(weights, d, p, inertia, y, s):
    """Objective, J, of y: 1/2 sum_i w_i |d_i - p_i|^2 + 1/2 (y - s)^T (M/h^2) (y - s), d = S q."""
    total = 0.0
    for i in range(len(weights)):
        for axis in range(3):
            total += weights[i] * (d[3 * i + axis] - p[3 * i + axis]) ** 2
    for i in range(len(inertia)):
        for axis in range(3):
            moved = 0.0
            for k in range(i):
                moved += inertia[i, k] * (y[3 * k + axis] - s[3 * k + axis])
            own = y[3 * i + axis] - s[3 * i + axis]
            total += own * (2.0 * moved + inertia[i, i] * own)
    return 0.5 * total


@inner
def _predict(z, v, acceleration, rate, rates, h, s):
    """Write the prediction s = z + h v + h^2 (a + c v + C v); a, c and C as in `run_frames`."""
    for i in range(len(z)):
        for axis in range(3):
            total = acceleration[i, axis] + rate * v[i, axis]
            for k in range(len(rates)):
                total += rates[i, k] * v[k, axis]
            s[3 * i + axis] = z[i, axis] + h * v[i, axis] + h**2 * total


@compiled(nogil=True)
def run_frames(
    positions, velocities, acceleration, rate, rates, h, fixed, free, targets, begun, count,
    rows, operators, sampled, history, seconds, watch,
):  # fmt: skip
    """Compute one frame for each of ``targets`` by `run_iterations`.

    Parameters
    ----------
    positions, velocities : (F + 1, K, 3) coordinates, the first ones given, the others written
    acceleration, rate, rates : a, c, C of the acceleration a + c v + C v by all forces
    h : time step, s
    fixed, free : (m,), (K',) indices of the fixed coordinates and of the free ones
    targets : (F, m, 3) values of the fixed coordinates in each frame
    begun : matrices for the start of a frame, see `_Operators`
    count, rows, operators, sampled, history : arguments of `run_iterations`
    seconds : (F, 4) s, times of the phases of each frame, written
    watch : buffer for the clock, from `pdrom.model.compiled.functions.clock`
    """
    response, coupling, nothing, s, held = begun
    offset, constant, z = operators[2:5]
    for f in range(len(targets)):
        began = now(watch)
        before, after, speeds = positions[f], positions[f + 1], velocities[f + 1]
        _predict(before, velocities[f], acceleration, rate, rates, h, s)
        changed = f == 0
        for i in range(len(fixed)):
            for axis in range(3):
                changed = changed or targets[f, i, axis] != held[3 * i + axis]
                s[3 * fixed[i] + axis] = held[3 * i + axis] = targets[f, i, axis]
        product(response, len(free), len(before), nothing, s, constant)
        # with unchanged targets, ``offset`` is that of the previous frame
        if changed:
            product(coupling, rows, len(fixed), nothing, held, offset)
        for i in range(len(free)):
            for axis in range(3):
                z[3 * i + axis] = s[3 * free[i] + axis]
        between = now(watch)
        run_iterations(count, len(free), rows, operators, sampled, history)
        ended = now(watch)
        for i in range(len(free)):
            for axis in range(3):
                s[3 * free[i] + axis] = z[3 * i + axis]
        for i in range(len(before)):
            for axis in range(3):
                after[i, axis] = s[3 * i + axis]
                speeds[i, axis] = (after[i, axis] - before[i, axis]) / h
        seconds[f, 0], seconds[f, 1] = between - began, ended - between
        seconds[f, 3] = now(watch) - ended
