"""Where the time of a frame goes, by implementation (claim C1)."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="Where the time of a frame goes",
    caption=(
        "Share of the local step and of the global solve in the time of a full-order frame, for "
        "three implementations of the same local step. The printed number is the share of the "
        "local step, that is of both shades of orange: the projections and the right-hand side "
        "that is assembled from them, in one pass where they are compiled. The dashed line is the "
        "70 % of claim C1; beside the bar stands the time per frame. An interpreted loop confirms "
        "the claim everywhere, compiled code only where projections are dear."
    ),
    reads=(TableOf("local_share"),),
    options=Scenes,
)
