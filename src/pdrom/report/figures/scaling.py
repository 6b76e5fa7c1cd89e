"""Time of an iteration against the number of vertices."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="Cost against mesh size",
    caption=(
        "Time of one local/global iteration against the number of vertices: the full-order run "
        "with one thread and with two, the same with only the local step reduced, and the "
        "hyper-reduced run in a position subspace, whose cost hardly depends on the mesh. Beside "
        "the ends of curves stands the exponent of a fitted power law, where there are three sizes "
        "of the mesh or more. Below, the time of assembly and factorisation and the memory that "
        "they take."
    ),
    reads=(
        TableOf("scaling"),
        TableOf("scaling_fit"),
    ),
    options=Scenes,
)
