"""Anderson acceleration of the local/global iteration (Peng et al. 2018, section 3).

One local and one global step are a map G of the positions; its fixed point solves the frame. In
place of y <- G(y) the next iterate is the combination of the last few images whose combined
residual f = G(y) - y is smallest. An iterate whose objective is above the last one is refused and
replaced by the plain image, which cannot rise: the objective stays monotone, the fixed point the
same.
"""

import numpy as np

from pdrom.model.compiled.dots import dot
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import flat, write

# Relative Tikhonov term of the small least-squares problem: nearly parallel residual differences
# (close to convergence) must not blow up the weights.
REGULARISATION = 1e-14
# Entries of the history's counts: differences so far (-1: no iterate yet), refused iterates.
DIFFERENCES, REFUSED = 0, 1


@inner
def _weights(gram, projection, count):
    """Solve the regularised normal equations (count, count) by Cholesky; zero weights if they
    are not positive definite, so that the plain image is taken."""
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
    """Forget all iterates of ``history``: another frame or substep begins."""
    history[6][DIFFERENCES] = -1
    history[7][0] = np.inf


@compiled
def refuse(history, y, objective, plain=1):
    """See `Anderson.refuse` of ``history``; ``y`` (n,) has this ``objective``.

    The first ``plain`` images after a start or a refusal are not compared: they are images of the
    local/global iteration, which cannot rise.
    """
    start, _, image, _, _, _, numbers, last = history
    if numbers[DIFFERENCES] >= plain and objective > last[0]:
        write(image, y)
        numbers[DIFFERENCES] = -1
        numbers[REFUSED] += 1
        return True
    last[0] = objective
    write(y, start)
    return False


@compiled
def combine(history, image):
    """See `Anderson.combine` of ``history``; ``image`` (n,) are all numbers of G(y)."""
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
"""Memory for the iterates of a frame, see `Anderson.history`."""


def _history(window: int, n: int) -> History:
    """Memory for a frame's iterates of n numbers.

    The accepted iterate, and the residual and image of the one before (n,); ``window`` differences
    of residuals and of images (window, n), the Gram matrix of the former; `DIFFERENCES` so far and
    iterates `REFUSED`; the objective of the accepted iterate (1,).
    """
    vectors = [np.empty(n) for _ in range(3)]
    differences = [np.empty((window, n)) for _ in range(2)]
    return (*vectors, *differences, np.empty((window, window)), np.zeros(2, np.int64), np.empty(1))


# Of iterations without acceleration. Compiled loops tell it by its type, so that a process without
# acceleration compiles nothing of it.
NO_HISTORY = None


class Anderson:
    """Accelerates the iterations of one step loop.

    Parameters
    ----------
    window : how many differences of earlier iterates are combined

    Attributes
    ----------
    history : what `refuse` and `combine` of compiled loops take
    """

    def __init__(self, window: int) -> None:
        self._window = window
        self.history = _history(window, 0)

    @property
    def refused(self) -> int:
        """Number of iterates refused so far."""
        return int(self.history[6][REFUSED])

    def begin_frame(self, y: np.ndarray) -> None:
        """Forget the last frame; ``y`` (n, 3) is the first iterate of this one."""
        n, refused = _numbers(y).size, self.refused
        if n != len(self.history[0]):
            self.history = _history(self._window, n)
            self.history[6][REFUSED] = refused
        forget(self.history)

    def refuse(self, y: np.ndarray, objective: float) -> bool:
        """Whether the iterate ``y`` raises the objective (J); it is then replaced by the plain
        image of the last one and the history is dropped. An unknown objective (nan) never does.
        """
        return refuse(self.history, _numbers(y), objective)

    def combine(self, image: np.ndarray) -> None:
        """Overwrite ``image`` = G(y) of the accepted y by the next iterate."""
        combine(self.history, _numbers(image))


def _numbers(y: np.ndarray) -> np.ndarray:
    """All numbers of y as a flat view; rows padded to four come with their zeros."""
    return y.reshape(-1) if y.flags.c_contiguous else flat(y)
