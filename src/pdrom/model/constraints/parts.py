"""A group's elements in one or two parts, always the same ones, so that two threads change no bits.

A small group is one part. In a large one the first part adds to the right-hand side itself, the
second to an array of its own that is added afterwards. The split does not depend on the number of
threads: one thread does the parts one after the other.
"""

from collections.abc import Callable

import numpy as np

from pdrom.model.constraints.second_thread import both

# (first, last, part, rhs) -> energy of the units first .. last - 1, S^T W p added to rhs
Kernel = Callable[[int, int, int, np.ndarray], float]


class Parts:
    """Partition of ``units`` (elements or blocks of them).

    Parameters
    ----------
    units : their number
    split : whether there are two parts
    vertices : number N of vertices
    touched : function of a first unit: vertices of this and all later units
    """

    def __init__(
        self, units: int, split: bool, vertices: int, touched: Callable[[int], np.ndarray]
    ) -> None:
        self._units = units
        self._middle = units
        if split and units > 1:
            self._middle = units // 2
            later = touched(self._middle)
            self._rows = slice(int(later.min()), int(later.max()) + 1)
            self._other = np.zeros((vertices, 3))

    @property
    def count(self) -> int:
        """1 or 2."""
        return 1 if self._middle == self._units else 2

    def accumulate(self, kernel: Kernel, rhs: np.ndarray, threads: int) -> float:
        """Add the contributions of all units to ``rhs`` (N, 3) and return their energy."""
        if self.count == 1:
            return kernel(0, self._units, 0, rhs)
        rows, other = self._rows, self._other

        def second() -> float:
            other[rows] = 0.0
            return kernel(self._middle, self._units, 1, other)

        energies = both(lambda: kernel(0, self._middle, 0, rhs), second, threads)
        rhs[rows] += other[rows]
        return sum(energies)
