"""DEIM on whole elements: all 3p entries of an element are taken at once."""

import numpy as np


def block_elements(v: np.ndarray, size: int) -> np.ndarray:
    """Element indices (r,) of the basis ``v`` (size e, r), one per mode, nested in r.

    Mode k is fitted by the earlier modes on the entries of the elements taken so far (least
    squares, more equations than unknowns); the element with the largest residual norm follows.
    """
    blocks = v.reshape(-1, size, v.shape[1])
    taken = np.zeros(len(blocks), dtype=bool)
    elements: list[int] = []
    for k in range(v.shape[1]):
        residual = blocks[:, :, k]
        if k:
            small = blocks[elements].reshape(-1, v.shape[1])
            fit = np.linalg.lstsq(small[:, :k], small[:, k], rcond=None)[0]
            residual = residual - blocks[:, :, :k] @ fit
        norm = np.einsum("ei,ei->e", residual, residual)
        norm[taken] = -1.0
        element = int(np.argmax(norm))
        taken[element] = True
        elements.append(element)
        if taken.all():
            break
    return np.array(elements, dtype=np.int64)
