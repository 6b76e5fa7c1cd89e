"""The iterations of DEIM, drawn on the mesh."""

from pdrom.core.paths import BASIS, MESH, SAMPLING
from pdrom.core.reads import Chosen
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Columns, Count, Experiments, Methods, View


class Options(Experiments, Methods, Count, Columns, View):
    """What may be chosen."""


FIGURE = Declaration(
    number=2,
    title="The first iterations of DEIM",
    caption=(
        "In step $k$ the residual of mode $k$ is taken against the modes before it, interpolated "
        "at the entries picked so far, and the entry where it is largest in absolute value is "
        "picked next. An element has the colour of its largest entry, so that the ringed one, "
        "which holds the picked entry, is the darkest; white dots are elements picked before. Each "
        "step asks for one number, whose whole element has to be projected for it."
    ),
    reads=(
        Chosen(MESH, first=True),
        Chosen(BASIS, first=True),
        Chosen(SAMPLING, first=True),
    ),
    options=Options,
)
