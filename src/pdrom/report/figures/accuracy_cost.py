"""Accuracy of reduced models against their time per frame."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Columns, Methods, Scenes


class Options(Scenes, Methods, Columns):
    """What may be chosen."""


FIGURE = Declaration(
    title="Accuracy against time per frame",
    caption=(
        "Error within the horizon against the time per frame of every reduced model, and of the "
        "full-order run with fewer iterations, all against the scene's own full-order run "
        "(vertical line: its time). The horizontal line is that run's own error, against the "
        "converged one: errors below it cannot be seen. Ringed points are those that no other "
        "beats in both; dashed lines mark 60 and 30 frames per second."
    ),
    reads=(TableOf("accuracy_cost"),),
    options=Options,
)
