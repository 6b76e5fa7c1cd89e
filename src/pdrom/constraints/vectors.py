"""Small compiled vector helpers that several groups use."""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def perpendicular(x, y, z):
    """A unit vector at right angles to the vector (x, y, z), always the same one; no zero input."""
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        length = np.sqrt(y * y + z * z)
        return 0.0, z / length, -y / length
    if abs(y) <= abs(z):
        length = np.sqrt(x * x + z * z)
        return -z / length, 0.0, x / length
    length = np.sqrt(x * x + y * y)
    return y / length, -x / length, 0.0
