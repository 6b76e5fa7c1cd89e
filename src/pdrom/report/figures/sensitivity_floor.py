"""How far runs drift apart that start almost alike, and the horizon that follows."""

from pdrom.core.paths import SENSITIVITY
from pdrom.core.reads import Chosen, Setting
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Columns, Scenes


class Options(Scenes, Columns):
    """What may be chosen."""


FIGURE = Declaration(
    title="Sensitivity floor and horizon",
    caption=(
        "How far full-order runs drift apart whose initial positions differ by "
        "{sensitivity.reference} of the extent. The horizon, given in the legends, is the first "
        "frame above the threshold of {sensitivity.threshold}: beyond it a reduced run cannot be "
        "judged by its error. Dashed lines are twins, scenes that end before."
    ),
    reads=(
        Chosen(SENSITIVITY),
        Setting("sensitivity.reference"),
        Setting("sensitivity.threshold"),
    ),
    options=Options,
)
