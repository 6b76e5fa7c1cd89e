"""Matplotlib types for type annotations in modules of figures; at run time they are `Any`.

Every run of the workflow imports all modules of figures, but only a job that draws one needs
Matplotlib. Modules of figures thus import its types from here and its functions when they draw.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
else:
    Artist = Axes = Axis = ScalarMappable = PolyCollection = Normalize = Any
    Figure = SubFigure = Line2D = Patch = Any

__all__ = [
    "Artist", "Axes", "Axis", "Figure", "Line2D", "Normalize", "Patch", "PolyCollection",
    "ScalarMappable", "SubFigure",
]  # fmt: skip
