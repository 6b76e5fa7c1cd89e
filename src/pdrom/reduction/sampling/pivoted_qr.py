"""The selection by pivots of a QR factorisation, of single entries or whole elements."""

from collections.abc import Sequence

import numpy as np

from pdrom.reduction.sampling.qdeim import qdeim_elements
from pdrom.reduction.sampling.selection import Selection


class PivotedQR(Selection):
    """Q-DEIM, not nested in r."""

    def one_a_mode(self, v: np.ndarray, size: int, ranks: Sequence[int]) -> dict[int, np.ndarray]:
        return {r: qdeim_elements(v[:, :r], size) for r in ranks}
