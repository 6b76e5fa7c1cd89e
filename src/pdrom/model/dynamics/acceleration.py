"""Fewer local/global iterations per frame: Anderson acceleration, and L-BFGS to convergence.

A local and a global step define a map G of the positions; at its fixed point the objective of the
frame is stationary. Anderson acceleration (Peng et al. 2018, section 3) replaces y <- G(y) by the
affine combination of the last few images G(y) for which the same combination of the residuals
f = G(y) - y is smallest. An iterate that raises the objective is rejected and replaced by the last
image G(y), which cannot raise it. The objective never rises, and the fixed point is that of G.

The iteration is a quasi-Newton step with the constant system matrix A as Hessian and converges
slowly on stiff meshes. L-BFGS started from A (Liu, Bouaziz and Kavan 2017, section 4) converges in
far fewer evaluations.
"""

import numpy as np
from scipy import sparse

from pdrom.model.compiled.arithmetic import add, constant, first_three, scaled
from pdrom.model.compiled.dots import dot
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import WIDTH, at, flat, load, write, zeros
from pdrom.model.constraints.local_kernel import Table, call
from pdrom.model.dynamics.solvers import Factor
from pdrom.model.dynamics.sweeps import sweep

# Tikhonov term, relative to the diagonal, of the least-squares problem for the weights of a
# combination. It bounds them if residual differences are nearly parallel, as near convergence.
REGULARISATION = 1e-14
# Index of the number of differences in array 6 that `_history` returns; -1 there: no iterate yet
DIFFERENCES = 0
MEMORY = 8  # number of steps that L-BFGS stores
SUFFICIENT = 1e-4  # Armijo's constant: least ratio of the objective's decrease to -slope x step
EPSILON = float(np.finfo(float).eps)
SHORTEST = 1e-4  # least fraction of a step to try; then a local/global iteration replaces the step


@inner
def _weights(gram, projection, count):
    """Return weights (count,) of differences of images G(y) (see top) by regularised least squares;
    zeros if the Gram matrix ``gram`` of the residual differences is not positive definite."""
    factor, weights = np.zeros((count, count)), np.zeros(count)
    for i in range(count):
        for j in range(i + 1):
            value = gram[i, j]
            if i == j:
                value *= 1.0 + REGULARISATION
            for k in range(j):
                value -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = value / factor[j, j]
            elif value > REGULARISATION * gram[i, i] and np.isfinite(value):
                factor[i, i] = np.sqrt(value)
            else:
                return np.zeros(count)
    for i in range(count):
        weights[i] = projection[i]
        for k in range(i):
            weights[i] -= factor[i, k] * weights[k]
        weights[i] /= factor[i, i]
    for i in range(count - 1, -1, -1):
        for k in range(i + 1, count):
            weights[i] -= factor[k, i] * weights[k]
        weights[i] /= factor[i, i]
    return weights


@compiled
def forget(history):
    """Delete all iterates of ``history``, at the beginning of a frame or substep."""
    history[6][DIFFERENCES] = -1
    history[7][0] = np.inf


@compiled
def refuse(history, y, objective, plain=1):
    """Reject iterate ``y`` (n,) if its ``objective`` has risen; compiled form of `Anderson.refuse`.

    The first iterate, an iterate G(y) that replaced a rejected one, and the ``plain`` iterates that
    follow one of these are never rejected, since an iteration G does not raise the objective.
    """
    start, _, image, _, _, _, numbers, last = history
    if numbers[DIFFERENCES] >= plain and objective > last[0]:
        write(image, y)
        numbers[DIFFERENCES] = -1
        return True
    last[0] = objective
    write(y, start)
    return False


@compiled
def combine(history, image):
    """Overwrite ``image`` = G(y) (n,) by the next iterate; compiled form of `Anderson.combine`."""
    start, residual, last_image, residuals, images, gram, numbers, _ = history
    numbers[DIFFERENCES] += 1
    differences, window = numbers[DIFFERENCES], len(gram)
    count, slot = min(differences, window), (differences - 1) % window
    n = len(image)
    for i in range(n):
        new = image[i] - start[i]
        if differences:
            residuals[slot, i] = new - residual[i]
            images[slot, i] = image[i] - last_image[i]
        residual[i] = new
        last_image[i] = image[i]
    if not differences:
        return
    projection = np.empty(count)
    for j in range(count):
        gram[slot, j] = gram[j, slot] = dot(residuals[slot], residuals[j])
        projection[j] = dot(residuals[j], residual)
    weights = _weights(gram, projection, count)
    for j in range(count):
        for i in range(n):
            image[i] -= weights[j] * images[j, i]


History = tuple[np.ndarray, ...]
"""Arrays with the iterates of a frame, in the order that `_history` describes."""


def _history(window: int, n: int) -> History:
    """Return an empty history: arrays for the iterates of a frame, which have n numbers each.

    They are: the last accepted iterate, its residual and image (n,); ``window`` differences of
    residuals and of images (window, n); Gram matrix of the residual differences; the number (1,)
    of differences since the history was emptied; the objective of the accepted iterate (1,).
    """
    vectors = [np.empty(n) for _ in range(3)]
    differences = [np.empty((window, n)) for _ in range(2)]
    return (*vectors, *differences, np.empty((window, window)), np.zeros(1, np.int64), np.empty(1))


# Value in place of a history for iterations without acceleration. Compiled loops recognise it by
# its type and then do not compile the acceleration.
NO_HISTORY = None


class Anderson:
    """Anderson acceleration of the iterations of one step loop.

    window : largest number of differences of earlier iterates that are combined
    history : arrays for the compiled functions `refuse` and `combine`
    """

    def __init__(self, window: int) -> None:
        self._window = window
        self.history = _history(window, 0)

    def begin_frame(self, y: np.ndarray) -> None:
        """Delete the iterates of the last frame; ``y`` (n, 3) is the first of a new frame."""
        n = _numbers(y).size
        if n != len(self.history[0]):
            self.history = _history(self._window, n)
        forget(self.history)

    def refuse(self, y: np.ndarray, objective: float) -> bool:
        """Return whether iterate ``y`` is rejected: its ``objective``, J, has risen (nan: not).
        Then ``y`` becomes G (see top) of the last accepted iterate, and the history is deleted."""
        return refuse(self.history, _numbers(y), objective)

    def combine(self, image: np.ndarray) -> None:
        """Overwrite the ``image`` G(y) of the last accepted iterate y by the next iterate."""
        combine(self.history, _numbers(image))


def _numbers(y: np.ndarray) -> np.ndarray:
    """Return a flat view of y; it includes a zero after each row if y is stored as (n, 4)."""
    return y.reshape(-1) if y.flags.c_contiguous else flat(y)


Frame = tuple[np.ndarray, np.ndarray, np.ndarray, Table, Factor]
"""Prediction s and (M/h^2) s, flat rows of four numbers; M/h^2 (n,); local kernels; factor of A."""


def minimise(
    frame: Frame, matrix: sparse.csr_array, start: np.ndarray, tolerance: float, limit: int
) -> tuple[np.ndarray, float, int]:
    """Minimise the objective of a ``frame`` by L-BFGS in the metric A = ``matrix`` (n, n).

    The search begins at ``start`` (n, 3) m. It ends when one more local/global iteration would
    change no coordinate by more than ``tolerance``, m, or after ``limit`` evaluations. Return the
    last iterate (n, 3) m, the largest change by another iteration, m, and the evaluations.
    """
    n, metric = len(start), (matrix.indptr, matrix.indices, matrix.data)
    y, d, *others = np.empty((5, 3 * n))
    y[:] = start.reshape(-1)
    vectors = y, d, *others, *np.empty((4, MEMORY + 1, 3 * n)), np.empty((2, MEMORY + 1))
    memory = *frame, zeros(WIDTH * n), zeros(WIDTH * n), zeros(WIDTH * n), np.empty(n)
    objective, evaluations, pairs = _evaluate(y, d, memory), 1, 0
    d -= y
    while (change := float(np.abs(d).max(initial=0.0))) > tolerance and evaluations < limit:
        objective, more, pairs = _descend(objective, pairs, vectors, metric, memory)
        evaluations += more
    return y.reshape(-1, 3), change, evaluations


@inner
def _pad(vector, padded):
    """Write ``vector`` (3 n,) to ``padded`` (4 n,), whose rows have a fourth number."""
    for i in range(len(vector) // 3):
        for axis in range(3):
            padded[WIDTH * i + axis] = vector[3 * i + axis]


@compiled(nogil=True)
def _evaluate(y, image, frame):
    """Write the result G(y) of a local and a global step to ``image``; return the objective at y.

    Its gradient is A (y - G(y)); G(y) equals y at fixed vertices. Sums are in the order of NumPy.
    """
    s, base, inertia, (addresses, records), factor, padded, rhs, added, squares = frame
    panels, vertices, loads, work = factor
    _pad(y, padded)
    write(base, rhs)
    energy = 0.0
    for k in range(len(addresses)):
        for i in range(len(added)):
            added[i] = 0.0
        energy += call(addresses[k], padded.ctypes.data, added.ctypes.data, records[k])
        for i in range(len(rhs)):
            rhs[i] += added[i]
    for i in range(len(inertia)):
        v = WIDTH * i
        dx, dy, dz = padded[v] - s[v], padded[v + 1] - s[v + 1], padded[v + 2] - s[v + 2]
        squares[i] = dx * dx + dz * dz + dy * dy
    sweep(panels, vertices, loads, work, rhs, padded)
    for i in range(len(inertia)):
        for axis in range(3):
            image[3 * i + axis] = padded[WIDTH * i + axis]
    return energy + 0.5 * np.dot(inertia, squares)


@inner
def _multiply(metric, vector, padded, product):
    """Write A times ``vector`` (3 n,) to ``product``; ``padded`` is a working array."""
    indptr, indices, data = metric
    _pad(vector, padded)
    for i in range(len(indptr) - 1):
        total = constant(0.0)
        for k in range(indptr[i], indptr[i + 1]):
            total = add(total, scaled(data[k], load(padded, WIDTH * at(indices, k))))
        product[3 * i], product[3 * i + 1], product[3 * i + 2] = first_three(total)


@inner
def _find_direction(pairs, d, direction, memory):
    """Write the L-BFGS direction by the two-loop recursion (Nocedal 1980); ``d`` is -A^-1 times the
    gradient, ``memory`` holds the last of ``pairs`` pairs, see `_descend`."""
    steps, changes, a_steps, a_changes, (curvatures, alphas) = memory
    write(d, direction)
    oldest = max(0, pairs - MEMORY)
    for pair in range(pairs - 1, oldest - 1, -1):
        k = pair % len(steps)
        alphas[k] = np.dot(a_steps[k], direction) / curvatures[k]
        for i in range(len(d)):
            direction[i] -= alphas[k] * changes[k, i]
    for pair in range(oldest, pairs):
        k = pair % len(steps)
        length = alphas[k] - np.dot(a_changes[k], direction) / curvatures[k]
        for i in range(len(d)):
            direction[i] += length * steps[k, i]


@compiled(nogil=True)
def _descend(objective, pairs, vectors, metric, frame):
    """Do a step of L-BFGS with backtracking; return objective, numbers of evaluations and pairs.

    A pair consists of a step s; its change c of A^-1 times the gradient; A s; A c; s^T A c.
    """
    y, d, direction, trial, image, steps, changes, a_steps, a_changes, numbers = vectors
    padded = frame[5]
    _find_direction(pairs, d, direction, (steps, changes, a_steps, a_changes, numbers))
    _multiply(metric, d, padded, image)
    slope = -np.dot(image, direction)
    if slope >= 0.0:
        pairs = 0
        write(d, direction)
        slope = -np.dot(image, d)
    step, noise, evaluations = 1.0, 8.0 * EPSILON * abs(objective), 0
    value, plain = np.nan, False
    while True:
        for i in range(len(y)):
            trial[i] = y[i] + step * direction[i]
        value = _evaluate(trial, image, frame)
        evaluations += 1
        if plain or value <= objective + SUFFICIENT * step * slope + noise:
            break
        step *= 0.5
        if step < SHORTEST:
            pairs, step, plain = 0, 1.0, True
            write(d, direction)
    k = pairs % len(steps)
    for i in range(len(y)):
        after = image[i] - trial[i]
        steps[k, i], changes[k, i] = trial[i] - y[i], d[i] - after
        y[i], d[i] = trial[i], after
    _multiply(metric, steps[k], padded, a_steps[k])
    _multiply(metric, changes[k], padded, a_changes[k])
    numbers[0, k] = np.dot(steps[k], a_changes[k])
    return value, evaluations, pairs + (numbers[0, k] > 0.0)
