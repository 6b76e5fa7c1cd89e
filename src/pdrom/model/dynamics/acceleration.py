"""Anderson acceleration of the local/global iteration (Peng et al. 2018, section 3).

One local and one global step are a map G of the positions; its fixed point solves the frame. In
place of y <- G(y) the next iterate is the combination of the last few images whose combined
residual f = G(y) - y is smallest. An iterate whose objective is above the last one is refused and
replaced by the plain image, which cannot rise: the objective stays monotone, the fixed point the
same.
"""

import numpy as np
from numba import njit

from pdrom.model.compiled.rows import flat

# Relative Tikhonov term of the small least-squares problem: nearly parallel residual differences
# (close to convergence) must not blow up the weights.
REGULARISATION = 1e-14


@njit(cache=True)
def _dot(a, b):
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@njit(cache=True)
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


@njit(cache=True)
def _mix(start, image, residual, last_image, residuals, images, gram, slot, count, first):
    """Put the new differences into ``slot`` and overwrite ``image`` by the combination.

    ``residual`` and ``last_image`` hold those of the previous iterate and receive the new ones.
    """
    n = len(image)
    for i in range(n):
        new = image[i] - start[i]
        if not first:
            residuals[slot, i] = new - residual[i]
            images[slot, i] = image[i] - last_image[i]
        residual[i] = new
        last_image[i] = image[i]
    if first:
        return
    projection = np.empty(count)
    for j in range(count):
        gram[slot, j] = gram[j, slot] = _dot(residuals[slot], residuals[j])
        projection[j] = _dot(residuals[j], residual)
    weights = _weights(gram, projection, count)
    for j in range(count):
        for i in range(n):
            image[i] -= weights[j] * images[j, i]


def _numbers(y: np.ndarray) -> np.ndarray:
    """All numbers of y, not copied: of a view of rows of four with their zeros."""
    return y.reshape(-1) if y.flags.c_contiguous else flat(y)


class Anderson:
    """Accelerates the iterations of one step loop.

    Parameters
    ----------
    window : how many differences of earlier iterates are combined
    """

    def __init__(self, window: int) -> None:
        self._window = window
        self._start = np.empty(0)
        self.refused = 0

    def begin_frame(self, y: np.ndarray) -> None:
        """Forget the last frame; ``y`` (n, 3) is the first iterate of this one."""
        n = len(_numbers(y))
        if n != len(self._start):
            self._allocate(n)
        self._differences = -1
        self._last = np.inf

    def _allocate(self, n: int) -> None:
        self._start, self._residual, self._image = (np.empty(n) for _ in range(3))
        self._residuals, self._images = (np.empty((self._window, n)) for _ in range(2))
        self._gram = np.empty((self._window, self._window))

    def refuse(self, y: np.ndarray, objective: float) -> bool:
        """Whether the iterate ``y`` raises the objective (J); it is then replaced by the plain
        image of the last one and the history is dropped. An unknown objective (nan) never does.
        """
        if self._differences >= 1 and objective > self._last:
            _numbers(y)[...] = self._image
            self._differences = -1
            self.refused += 1
            return True
        self._last = objective
        np.copyto(self._start, _numbers(y))
        return False

    def combine(self, image: np.ndarray) -> None:
        """Overwrite ``image`` = G(y) of the accepted y by the next iterate."""
        self._differences += 1
        first = self._differences == 0
        slot = (self._differences - 1) % self._window
        count = min(self._differences, self._window)
        _mix(
            self._start, _numbers(image), self._residual, self._image, self._residuals,
            self._images, self._gram, slot, count, first,
        )  # fmt: skip
