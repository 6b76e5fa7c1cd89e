"""What an iteration of the full-order run buys, plain and accelerated."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Columns, Scenes


class Options(Scenes, Columns):
    """What may be chosen."""


FIGURE = Declaration(
    title="What an iteration buys",
    caption=(
        "Error of the full-order run within the horizon against the same run with every frame "
        "solved to convergence, over the time of a frame. Dots are the numbers of local/global "
        "iterations, printed at the plain ones; accelerated runs combine the last iterates so "
        "that their combined residual is smallest, and have the same fixed point."
    ),
    reads=(TableOf("accuracy_cost"),),
    options=Options,
)
