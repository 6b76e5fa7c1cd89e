"""The cloth with three groups: full order, and with one group reduced, over time."""

from pdrom.core.paths import FULL_ORDER, MESH, RERUNS, SENSITIVITY
from pdrom.core.reads import Chosen, Setting
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import ReducedRuns

FIGURE = Declaration(
    number=4,
    title="Three constraint groups, one of them reduced",
    caption=(
        "The cloth with bending, springs and strain at three instants: the full-order run, then "
        "runs in which the projections of one group only are reduced. The grey outline is the "
        "full-order run. Springs carry nearly all of the force, so that the other rows say little "
        "about the method; and what differs beyond the scene's horizon cannot be blamed on the "
        "reduction. A framed picture is drawn to the smaller scale given below it."
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
