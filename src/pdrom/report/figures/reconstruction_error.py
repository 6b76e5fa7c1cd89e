"""Reconstruction error of snapshots against the basis size, on the preprint's scenes."""

from pdrom.core.reads import Published, TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Beside, Columns, Experiments, Methods, Splits


class Options(Experiments, Methods, Splits, Columns, Beside):
    """What may be chosen."""


FIGURE = Declaration(
    number=8,
    title="Reconstruction error of the preprint's scenes",
    caption=(
        "Relative error of reconstructed projections against the number $r$ of basis vectors, for "
        "the snapshots used (train), the frames between them (test) and another run (held out). "
        "Errors above the axis are drawn on its rim with an arrow head."
    ),
    reads=(
        TableOf("reconstruction_error"),
        Published("reconstruction_error"),
    ),
    options=Options,
)
