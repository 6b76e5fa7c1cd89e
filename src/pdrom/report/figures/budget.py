"""What a frame's time buys: the smallest error for a few budgets."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="What a frame's time buys",
    caption=(
        "The setting with the smallest error within the horizon that fits a time per frame. "
        "Filled markers: reduced models, or the full-order run stopped earlier, against the "
        "scene's own full-order run. Hollow markers: the full-order run with the best number $K$ "
        "of iterations that fits, against the converged run. The two errors have different "
        "references. A mark on the left rim stands for an error at it or below."
    ),
    reads=(TableOf("budget"),),
    options=Scenes,
)
