"""Which elements the entries of vectorised DEIM hit, and what that costs."""

from pdrom.core.paths import MESH, SAMPLING, SNAPSHOTS
from pdrom.core.reads import Chosen
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Experiments, Methods, Ranks, View


class Options(Experiments, Methods, Ranks, View):
    """What may be chosen."""


FIGURE = Declaration(
    number=3,
    title="Elements hit by the entries of vectorised DEIM",
    caption=(
        "Single entries, picked without regard to elements, scatter over the mesh. Left: the "
        "elements they belong to, by axis. Middle: how many of its entries each touched element "
        "contributes. Right: numbers that have to be computed for $r$ interpolation entries, "
        "because a projection yields all entries of its element at once."
    ),
    reads=(
        Chosen(MESH),
        Chosen(SNAPSHOTS),
        Chosen(SAMPLING),
    ),
    options=Options,
)
