"""Error of reduced runs against time, with the sensitivity floor behind it."""

from pdrom.core.paths import RERUNS, SENSITIVITY
from pdrom.core.reads import Chosen, Setting
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Columns, Experiments, Methods, Ranks


class Options(Experiments, Methods, Ranks, Columns):
    """What may be chosen."""


FIGURE = Declaration(
    title="Error of reduced runs against time",
    caption=(
        "Relative error of reduced runs frame by frame. The shaded area is the sensitivity floor "
        "of the scene and the dotted line its horizon: errors to the right of it cannot be told "
        "from chaos."
    ),
    reads=(
        Chosen(RERUNS),
        Chosen(SENSITIVITY),
        Setting("sensitivity.reference"),
        Setting("sensitivity.threshold"),
    ),
    options=Options,
)
