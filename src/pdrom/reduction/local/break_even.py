"""Break-even of a reduced local step: its time against the full one, over r."""

from collections.abc import Sequence

import numpy as np


def break_even(r: Sequence[int], ratio: Sequence[float]) -> int | None:
    """Smallest size from which the reduced local step costs as much as the full one, for good.

    Between the last size below one and the first above it the ratio is interpolated linearly.
    None if the ratio is below one at the largest size; the smallest size if it never is below.

    Parameters
    ----------
    r : sizes, ascending
    ratio : time of the reduced local step over that of the full one, at each size
    """
    sizes, values = np.asarray(r, dtype=float), np.asarray(ratio, dtype=float)
    below = np.flatnonzero(values < 1.0)
    if len(below) == 0:
        return int(sizes[0])
    last = below[-1]
    if last == len(values) - 1:
        return None
    (a, b), (low, high) = sizes[last : last + 2], values[last : last + 2]
    return int(np.ceil(a + (b - a) * (1.0 - low) / (high - low) - 1e-9))
