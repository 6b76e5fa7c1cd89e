"""Q-DEIM on whole elements: pivoted QR whose pivots are elements."""

import numpy as np
from scipy import linalg


def block_qdeim_elements(v: np.ndarray, size: int) -> np.ndarray:
    """Element indices of the basis ``v`` (size e, r), one per mode (all e if e < r).

    As in Q-DEIM (Drmac and Gugercin 2016) the columns of V^T are pivots, here in groups of ``size``
    that belong to one element. The group with the largest Frobenius norm is taken, and the
    direction in R^r that dominates it is removed from all groups. Removing the whole group at once
    would exhaust R^r after about r / size elements; one direction an element gives as many elements
    as modes, to be compared with the greedy at equal cost. The removed directions are orthonormal
    and lie in the span of the taken groups, so the sampled rows of V have full column rank.

    Not nested in r. Cost O(n r^2), n = size e.
    """
    left = v.copy()
    taken = np.zeros(len(v) // size, dtype=bool)
    elements: list[int] = []
    for _ in range(min(v.shape[1], len(taken))):
        norm = np.einsum("eik,eik->e", *[left.reshape(len(taken), size, -1)] * 2)
        norm[taken] = -1.0
        element = int(np.argmax(norm))
        taken[element] = True
        elements.append(element)
        group = left[size * element : size * (element + 1)]
        direction = linalg.svd(group, full_matrices=False, check_finite=False)[2][0]
        left -= np.outer(left @ direction, direction)
    return np.array(elements, dtype=np.int64)
