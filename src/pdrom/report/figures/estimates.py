"""Does the distance to a finer model tell the error of a run, without the full order?"""

from pdrom.core.reads import Setting, TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="Estimated errors",
    caption=(
        "A dot for every run: its error within the horizon against the estimate, its distance to "
        "the companion. Left the training motions, right the held-out ones, of which nothing but "
        "the companion's run is used. Between the dashed lines the estimate is within a factor of "
        "three. Open dots are not resolved: the estimate is not above one and a half times the "
        "companion's own error on the training motion, and says no more than that the error is "
        "small. Dotted: {guard.threshold}, above which a guard takes it as an alarm. What lies "
        "outside is drawn on the rim."
    ),
    reads=(TableOf("estimates"), Setting("guard.threshold")),
    options=Scenes,
)
