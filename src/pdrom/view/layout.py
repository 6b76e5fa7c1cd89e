"""Constrained layout whose positions are the same in every process.

Matplotlib's layout solver sums in the order of memory addresses, so that positions differ in their
last bits between drawings, which sometimes changes a digit in the file.
"""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.transforms import Bbox

DIGITS = 6  # decimals of positions, which are fractions of the figure


class RoundedLayout(ConstrainedLayoutEngine):
    """Constrained layout that rounds positions to `DIGITS`."""

    def execute(self, fig: Figure) -> Any:
        """Lay out ``fig`` and round the positions of its axes; return the base class's result."""
        grids = super().execute(fig)
        for ax in fig.axes:
            kept = ax.get_in_layout()
            place = np.round(ax.get_position(original=True).extents, DIGITS)
            ax.set_position(Bbox.from_extents(*place), which="original")
            ax.set_in_layout(kept)  # `set_position` has reset it
        return grids
