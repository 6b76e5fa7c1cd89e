"""The cloth with three groups: full order, and with one group reduced, over time."""

from pdrom.core.paths import FULL_ORDER, MESH, RERUNS, SENSITIVITY
from pdrom.core.reads import Chosen, Setting
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import ReducedRuns

FIGURE = Declaration(
    number=4,
    title="Three constraint groups, one of them reduced",
    caption=(
        "The cloth with bending, springs and strain at instants up to the scene's horizon, beyond "
        "which no difference could be blamed on a reduction: the full-order run, then runs that "
        "reduce the projections of one group only, by two methods. Triangles are coloured by "
        "their distance to the full-order run, whose outline is grey; a framed picture is drawn to "
        "the smaller scale given below it. Springs carry nearly all of the force, so that reducing "
        "strain changes little whatever the method."
    ),
    reads=(
        Chosen(MESH),
        Chosen(FULL_ORDER),
        Chosen(RERUNS),
        Chosen(SENSITIVITY),
        Setting("sensitivity.reference"),
        Setting("sensitivity.threshold"),
    ),
    options=ReducedRuns,
)
