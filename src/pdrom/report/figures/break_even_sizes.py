"""Break-even of reduced local steps against the mesh size (claim C9)."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Columns, Methods, Scenes


class Options(Scenes, Methods, Columns):
    """What may be chosen."""


FIGURE = Declaration(
    title="Break-even on finer meshes",
    caption=(
        "Smallest $r$ from which the reduced local step costs as much as the full one, over the "
        "number of vertices, with the full step and the lift on one thread and on two. The first "
        "mesh is the scene's own; its basis is that of the study, those of the finer ones come "
        "from the first frames of a run."
    ),
    reads=(TableOf("breakeven"),),
    options=Options,
)
