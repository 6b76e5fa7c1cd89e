"""Anderson acceleration of the local/global iteration (Peng et al. 2018, section 3).

A local and a global step define a map G of the positions; at its fixed point the objective of the
frame is stationary. Instead of y <- G(y), the next iterate is the affine combination of the last
few images G(y) for which the same combination of the residuals f = G(y) - y is smallest. An iterate
whose objective is larger than that of the last one is rejected and replaced by the last image G(y),
whose objective cannot be larger. The objective never rises, and the fixed point is that of G.
"""

import numpy as np

from pdrom.model.compiled.dots import dot
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import flat, write

# Tikhonov term, relative to the diagonal, of the least-squares problem for the weights of a
# combination. It bounds them if residual differences are nearly parallel, as near convergence.
REGULARISATION = 1e-14
# Index of the number of differences in array 6 that `_history` returns; -1 there: no iterate yet
DIFFERENCES = 0


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
