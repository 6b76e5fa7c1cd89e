"""Numerical rank: what of a snapshot matrix is above round-off."""

import numpy as np


def numerical_rank(singular_values: np.ndarray, shape: tuple[int, int], roundoff: float) -> int:
    """Number of ``singular_values`` (n,) of a matrix of that ``shape`` above both round-off levels.

    The relative level max(shape) eps sigma_1 is the backward error of the SVD. The absolute level
    ``roundoff`` is the error of the data themselves: where a projection is the difference of
    cancelling terms, all of its singular values may be noise although they decay nicely.
    """
    if len(singular_values) == 0:
        return 0
    relative = max(shape) * np.finfo(float).eps * singular_values[0]
    return int(np.count_nonzero(singular_values > max(relative, roundoff)))
