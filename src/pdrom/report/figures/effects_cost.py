"""What each effect of a scene costs, and that an absent one costs nothing."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="What each effect costs",
    caption=(
        "Left: share of each effect in the time of a full-order frame, which is printed beside "
        "the bar. Right: the frame of one scene built without some of its effects; the tick is "
        "the whole less what these effects cost in it. A bar that ends at the tick pays nothing "
        "for what the scene does not list."
    ),
    reads=(
        TableOf("effects_cost"),
        TableOf("effects_left_out"),
    ),
    options=Scenes,
)
