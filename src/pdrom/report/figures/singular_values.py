"""Decay of the singular values of the snapshot matrices."""

from pdrom.core.reads import Published, TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Beside, Columns, Experiments


class Options(Experiments, Columns, Beside):
    """What may be chosen."""


FIGURE = Declaration(
    number=9,
    title="Decay of the singular values",
    caption=(
        "Singular values of the training snapshots, relative to the first. Hollow ones lie below "
        "the round-off of the projections and are noise. Grey lines are the output of the "
        "published code for the scene that comes closest."
    ),
    reads=(
        TableOf("singular_values"),
        Published("singular_values"),
    ),
    options=Options,
)
