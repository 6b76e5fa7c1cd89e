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
        "The snapshots of one constraint group, a column each, less their mean, are the product of "
        "modes, singular values (a diagonal, dark where large) and coefficients; red entries are "
        "positive, blue ones negative. Below, columns of the first matrix on the moving mesh and "
        "the first modes on the mesh at rest: an element has the colour of one of its entries, "
        "whose axis and row are named, relative to the largest."
    ),
    reads=(
        Chosen(MESH, first=True),
        Chosen(FULL_ORDER, first=True),
        Chosen(SNAPSHOTS, first=True),
        Chosen(BASIS, first=True),
    ),
    options=Options,
)
