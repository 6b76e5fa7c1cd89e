"""Fewer local/global iterations per frame: Anderson acceleration, and L-BFGS to convergence.

A local and a global step define a map G of the positions; at its fixed point the objective of the
frame is stationary. Anderson acceleration (Peng et al. 2018, section 3) replaces y <- G(y) by the
affine combination of the last few images G(y) for which the same combination of the residuals
f = G(y) - y is smallest. An iterate whose objective is larger than that of the last one is rejected
and replaced by the last image G(y), whose objective cannot be larger. The objective never rises,
and the fixed point is that of G.

The iteration is a quasi-Newton step with the constant system matrix A as Hessian and converges
slowly on stiff meshes. L-BFGS started from A (Liu, Bouaziz and Kavan 2017, section 4) reaches the
same limit in far fewer evaluations.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse

from pdrom.model.compiled.dots import dot
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import flat, write

# Tikhonov term, relative to the diagonal, of the least-squares problem for the weights of a
# combination. It bounds them if residual differences are nearly parallel, as near convergence.
REGULARISATION = 1e-14
# Index of the number of differences in array 6 that `_history` returns; -1 there: no iterate yet
DIFFERENCES = 0
MEMORY = 8  # number of steps that L-BFGS stores
SUFFICIENT = 1e-4  # Armijo's constant: least ratio of the objective's decrease to -slope x step
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

    Parameters
    ----------
    window : largest number of differences of earlier iterates that are combined

    Attributes
    ----------
    history : arrays for the compiled functions `refuse` and `combine`
    """

    def __init__(self, window: int) -> None:
        self._window = window
        self.history = _history(window, 0)

    def begin_frame(self, y: np.ndarray) -> None:
        """Delete the iterates of the last frame; ``y`` (n, 3) is the first iterate of a new one."""
        n = _numbers(y).size
        if n != len(self.history[0]):
            self.history = _history(self._window, n)
        forget(self.history)

    def refuse(self, y: np.ndarray, objective: float) -> bool:
        """Return whether iterate ``y`` is rejected: its ``objective``, J, has risen (nan: not).
        It is then overwritten by G (see top) of the last accepted iterate, the history deleted."""
        return refuse(self.history, _numbers(y), objective)

    def combine(self, image: np.ndarray) -> None:
        """Overwrite the ``image`` G(y) of the last accepted iterate y by the next iterate."""
        combine(self.history, _numbers(image))


def _numbers(y: np.ndarray) -> np.ndarray:
    """Return a flat view of y; it includes a zero after each row if y is stored as (n, 4)."""
    return y.reshape(-1) if y.flags.c_contiguous else flat(y)


Evaluate = Callable[[np.ndarray], tuple[float, np.ndarray]]


class Minimum(NamedTuple):
    """Last iterate (n, 3), m; largest change of its coordinates by one more local/global iteration,
    m; number of evaluations, each of a local and a global step."""

    y: np.ndarray
    change: float
    evaluations: int


def minimise(
    evaluate: Evaluate, matrix: sparse.csr_array, y: np.ndarray, tolerance: float, limit: int
) -> Minimum:
    """Minimise the objective of a frame by L-BFGS in the metric of ``matrix``, with backtracking.

    evaluate : function of y; returns the objective, and the result G(y) of one local/global
        iteration from y. The gradient is A (y - G(y)); G(y) equals y at fixed vertices.
    matrix : A, (n, n) symmetric positive definite
    y : (n, 3) start, m
    tolerance : the minimisation ends when no entry of G(y) - y exceeds this, m
    limit : largest number of evaluations
    """
    pairs: list[_Pair] = []
    objective, target = evaluate(y)
    d, evaluations = target - y, 1
    while np.abs(d).max(initial=0.0) > tolerance and evaluations < limit:
        direction = _direction(d, pairs)
        slope = -float(np.vdot(matrix @ d, direction))
        if slope >= 0.0:
            pairs, direction = [], d
            slope = -float(np.vdot(matrix @ d, d))
        step, noise = 1.0, 8.0 * np.finfo(float).eps * abs(objective)
        while True:
            trial = y + step * direction
            value, target = evaluate(trial)
            evaluations += 1
            if value <= objective + SUFFICIENT * step * slope + noise:
                break
            step *= 0.5
            if step < SHORTEST:
                trial, pairs = y + d, []
                value, target = evaluate(trial)
                evaluations += 1
                break
        after = target - trial
        moved, change = trial - y, d - after
        both = matrix @ np.hstack([moved, change])
        a_moved, a_change = both[:, :3].copy(), both[:, 3:].copy()  # faster than strided views
        curvature = float(np.vdot(moved, a_change))
        if curvature > 0.0:
            pairs = [*pairs, _Pair(moved, change, a_moved, a_change, curvature)][-MEMORY:]
        y, d, objective = trial, after, value
    return Minimum(y, float(np.abs(d).max(initial=0.0)), evaluations)


class _Pair(NamedTuple):
    """L-BFGS step s; change c, by this step, of A^-1 times the gradient; A s; A c; s^T A c."""

    step: np.ndarray
    change: np.ndarray
    a_step: np.ndarray
    a_change: np.ndarray
    curvature: float


def _direction(d: np.ndarray, pairs: list[_Pair]) -> np.ndarray:
    """L-BFGS direction by the two-loop recursion (Nocedal 1980); ``d`` = -A^-1 times gradient."""
    q, alphas = d.copy(), []
    for pair in reversed(pairs):
        alpha = np.vdot(pair.a_step, q) / pair.curvature
        q -= alpha * pair.change
        alphas.append(alpha)
    for pair, alpha in zip(pairs, reversed(alphas), strict=True):
        q += (alpha - np.vdot(pair.a_change, q) / pair.curvature) * pair.step
    return q
