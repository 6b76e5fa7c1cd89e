"""Runs of the bars, reduced."""

from pdrom.core.paths import FULL_ORDER, MESH, RERUNS, SENSITIVITY
from pdrom.core.reads import Chosen, Setting
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import ReducedRuns

FIGURE = Declaration(
    title="The bar, reduced",
    caption=(
        "Bars with tetrahedral constraints: full order against reduced projections, by basis "
        "size. The grey outline is the full-order run at the same instant; a framed picture is "
        "drawn to the smaller scale given below it."
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
    drawing="reduced_runs",
)
