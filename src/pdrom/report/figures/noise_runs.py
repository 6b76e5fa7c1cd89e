"""Reductions of projections that are round-off, on bases of that noise."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="Reductions on bases of round-off",
    caption=(
        "Groups whose projections are round-off, reduced on bases of it, without a cutoff. Each "
        "cell holds the starts, each with another round-off, of which the run fails (it does not "
        "start, or misses by more than a tenth of the motion), of all starts; columns are methods "
        "and sizes, rows are scenes with the axes that the round-off of the start reaches. Where "
        "it leaves out the axis across the sheet, and nothing else moves the sheet there, the "
        "joint selection's separate system of that axis is exactly singular; where it moves a "
        "single vertex across the sheet, this hangs on the vertex and on the size."
    ),
    reads=(TableOf("noise"),),
    options=Scenes,
)
