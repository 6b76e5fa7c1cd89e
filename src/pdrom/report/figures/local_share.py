"""Where the time of a frame goes, by implementation (claim C1)."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="Where the time of a frame goes",
    caption=(
        "Share of local projections, right-hand side and global solve in the time of a full-order "
        "frame, for three implementations of the same local step; the dashed line is the 70 % of "
        "claim C1. The printed number is the share of the local projections, beside the bar "
        "stands the time per frame."
    ),
    reads=(TableOf("local_share"),),
    options=Scenes,
)
