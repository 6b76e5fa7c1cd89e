"""DEIM on whole elements: all 3p entries of an element are taken at once."""

import numpy as np

from pdrom.reduction.sampling.deim import tie_weights
from pdrom.reduction.sampling.growing_fit import GrowingFit


def block_elements(v: np.ndarray, size: int) -> np.ndarray:
    """Element indices of the basis ``v`` (size e, r), one per mode (all e if e < r), nested in r.

    Mode k is fitted by the earlier modes on the entries of the elements taken so far (least
    squares, more equations than unknowns); the element with the largest residual norm (times
    `tie_weights`) follows.
    """
    modes, total = np.asfortranarray(v), len(v) // size
    fit, weights = GrowingFit(v.shape[1]), tie_weights(total) ** 2
    elements = np.empty(min(v.shape[1], total), dtype=np.int64)
    for k in range(len(elements)):
        residual = modes[:, k]
        if k:
            residual = residual - modes[:, :k] @ fit.coefficients(k)
        norm = weights * np.square(residual).reshape(total, size).sum(axis=1)
        norm[elements[:k]] = -1.0
        elements[k] = element = int(np.argmax(norm))
        fit.add(v[size * element : size * (element + 1)])
    return elements
