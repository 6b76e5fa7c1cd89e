"""NaN and infinity are refused before anything is computed with them."""

import numpy as np


def require_finite(name: str, array: np.ndarray, error: type[Exception]) -> np.ndarray:
    """Return ``array``, or raise ``error`` with ``name`` and its first entry that is not finite."""
    finite = np.isfinite(array)
    if not finite.all():
        first = tuple(int(i) for i in np.argwhere(~finite)[0])
        raise error(f"{name}: entry {first} is {array[first]}, finite numbers are required")
    return array
