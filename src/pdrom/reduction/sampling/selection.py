"""Interface of selections: orders in which blocks of rows of a basis are sampled."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from pdrom.reduction.sampling.gappy_pod_e import oversample


class Selection(ABC):
    """A rule that picks blocks of rows: entries (blocks of one row) or whole elements.

    A subclass is named in `pdrom.reduction.selections`.
    """

    @abstractmethod
    def one_a_mode(self, v: np.ndarray, size: int, ranks: Sequence[int]) -> dict[int, np.ndarray]:
        """Distinct blocks, as many as modes (all, if there are fewer) for every r of ``ranks``.

        Parameters
        ----------
        v : (size e, r) modes, ``size`` consecutive rows for each of the e blocks; at least as many
            columns as the largest of ``ranks``
        """

    def extend(self, v: np.ndarray, size: int, chosen: np.ndarray, count: int) -> np.ndarray:
        """``chosen`` blocks followed by others, ``count`` in all: by GappyPOD+E.

        Parameters
        ----------
        v : (rows, r) basis
        chosen : (m,) blocks to start with
        size : rows of a block
        """
        return oversample(v, size, chosen, count=count)
