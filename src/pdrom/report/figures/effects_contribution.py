"""What each effect of a scene does to its run."""

from pdrom.core.paths import CONTRIBUTIONS
from pdrom.core.reads import Chosen, TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="What each effect contributes",
    caption=(
        "Left: norm of the force of each effect on the free vertices over the frames of a scene "
        "(of a hold: on the vertices that it holds). Right: how far the run moves "
        "when an effect is left out, before the horizon; the grey bar ends at the "
        "sensitivity floor, below which nothing can be told from round-off. Open markers "
        "lie below the floor, at the left edge where nothing changes at all. The only group of a "
        "scene cannot be left out."
    ),
    reads=(TableOf("effects_contribution"), Chosen(CONTRIBUTIONS)),
    options=Scenes,
)
