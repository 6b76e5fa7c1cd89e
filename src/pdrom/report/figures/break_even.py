"""Break-even of reduced local steps against the basis size (claim C9)."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Columns, Experiments, Methods


class Options(Experiments, Methods, Columns):
    """What may be chosen."""


FIGURE = Declaration(
    title="When a reduced local step stops paying",
    caption=(
        "Time of the reduced local step over that of the full one, both compiled and on one "
        "thread, against the number $r$ of basis vectors; one line per scene and method, timed "
        "alone on states of the full-order run. Above the dashed line the reduction costs more "
        "than all projections. Lines end at the numerical rank."
    ),
    reads=(TableOf("breakeven"),),
    options=Options,
)
