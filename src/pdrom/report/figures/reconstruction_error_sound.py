"""Reconstruction error against the basis size, on well-posed scenes."""

from pdrom.core.reads import Published, TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Beside, Columns, Experiments, Methods, Splits


class Options(Experiments, Methods, Splits, Columns, Beside):
    """What may be chosen."""


FIGURE = Declaration(
    title="Reconstruction error of the well-posed scenes",
    caption=(
        "As the figure for the preprint's scenes, for scenes whose motion is not decided by round- "
        "off: horizontal sheets held on one side, and a sheet with a curved rest shape."
    ),
    reads=(
        TableOf("reconstruction_error"),
        Published("reconstruction_error"),
    ),
    options=Options,
    drawing="reconstruction_error",
)
