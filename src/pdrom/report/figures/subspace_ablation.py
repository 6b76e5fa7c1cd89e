"""Variants of block DEIM in a position subspace: what mends it, and by how much."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="What mends block DEIM in a position subspace",
    caption=(
        "Runs with positions and projections reduced, divided by the error of the full "
        "projections in the same snapshot subspace (dashed: no worse). Above the line one change "
        "at a time, below it combinations. Points on the right rim blew up or are worse still; "
        "crosses mark bases that the gain check refused. Right, the gain."
    ),
    reads=(TableOf("subspace_ablation"),),
    options=Scenes,
)
