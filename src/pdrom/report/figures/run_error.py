"""Error of reduced runs against time, with the sensitivity floor behind it."""

from pdrom.core.paths import REPEATED_FRAMES, RERUNS, SENSITIVITY
from pdrom.core.reads import Chosen, Every, Setting, TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Columns, Experiments, Methods, Ranks


class Options(Experiments, Methods, Ranks, Columns):
    """What may be chosen."""


FIGURE = Declaration(
    title="Error of reduced runs against time",
    caption=(
        "Relative error of reduced runs frame by frame. The shaded area is the sensitivity floor "
        "of the scene and the dotted line its horizon: errors to the right of it cannot be told "
        "from chaos. Bands in the colour of a method, in some scenes and up to the horizon, hold "
        "the same runs trained on as many frames drawn anew."
    ),
    reads=(
        Chosen(RERUNS),
        Chosen(SENSITIVITY),
        TableOf("repetitions"),
        Every(REPEATED_FRAMES),
        Setting("sensitivity.reference"),
        Setting("sensitivity.threshold"),
    ),
    options=Options,
)
