"""Snapshots of a group's projections and the first POD modes, drawn on the mesh."""

from pdrom.core.paths import BASIS, FULL_ORDER, MESH, SNAPSHOTS
from pdrom.core.reads import Chosen
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Count, Experiments, Instants, Methods, View


class Options(Experiments, Methods, Instants, Count, View):
    """What may be chosen."""


FIGURE = Declaration(
    number=1,
    title="Snapshots of the projections and their modes",
    caption=(
        "Top: the training snapshots of one constraint group, one row each. Middle: snapshots on "
        "the moving sheet, coloured by how far each projection has changed since the first frame. "
        "Bottom: the first POD modes of these snapshots, coloured by their size on each element."
    ),
    reads=(
        Chosen(MESH, first=True),
        Chosen(FULL_ORDER, first=True),
        Chosen(SNAPSHOTS, first=True),
        Chosen(BASIS, first=True),
    ),
    options=Options,
)
