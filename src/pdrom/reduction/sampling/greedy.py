"""Greedy selection of single entries or elements by the largest residual of the next mode."""

from collections.abc import Sequence

import numpy as np

from pdrom.reduction.sampling.deim import Selection, block_elements, deim_entries


class Greedy(Selection):
    """DEIM by entries or elements; the samples for r modes begin with those for fewer modes."""

    def one_a_mode(self, v: np.ndarray, size: int, ranks: Sequence[int]) -> dict[int, np.ndarray]:
        path = deim_entries(v) if size == 1 else block_elements(v, size)
        return {r: path[:r] for r in ranks}
