"""The selection by pivots of a QR factorisation, of single entries or whole elements."""

from collections.abc import Sequence

import numpy as np

from pdrom.reduction.sampling.block_qdeim import block_qdeim_elements
from pdrom.reduction.sampling.qdeim import qdeim_entries
from pdrom.reduction.sampling.selection import Selection


class PivotedQR(Selection):
    """Q-DEIM, not nested in r."""

    def one_a_mode(self, v: np.ndarray, size: int, ranks: Sequence[int]) -> dict[int, np.ndarray]:
        pivots = qdeim_entries if size == 1 else (lambda modes: block_qdeim_elements(modes, size))
        return {r: pivots(v[:, :r]) for r in ranks}
