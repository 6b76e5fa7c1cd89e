"""Matplotlib types for type annotations in modules of figures; at run time they are `Any`.

Every run of the workflow imports all modules of figures, but only a job that draws one needs
Matplotlib. Modules of figures thus import its types from here and its functions when they draw.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.artist import Artist as Artist
    from matplotlib.axes import Axes as Axes
    from matplotlib.axis import Axis as Axis
    from matplotlib.cm import ScalarMappable as ScalarMappable
    from matplotlib.collections import PolyCollection as PolyCollection
    from matplotlib.colors import Normalize as Normalize
    from matplotlib.figure import Figure as Figure
    from matplotlib.lines import Line2D as Line2D
    from matplotlib.patches import Patch as Patch
else:
    Artist = Axes = Axis = ScalarMappable = PolyCollection = Normalize = Any
    Figure = Line2D = Patch = Any
