"""Runs of sheets with bending only, reduced."""

from pdrom.core.paths import FULL_ORDER, MESH, NOISE_RUNS, RERUNS, SENSITIVITY
from pdrom.core.reads import Chosen, Every, Setting, TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import ReducedRuns

FIGURE = Declaration(
    number=5,
    title="Bending only, reduced",
    caption=(
        "Sheets with bending constraints only, near the end of the run: full order against "
        "reduced projections. The projections of a flat sheet are round-off: in the preprint's two "
        "scenes the basis is one of noise, and what it does depends on which axes the round-off "
        "of the start reaches (drawn is the first start of which some sizes run and others do "
        "not, or else the first; all are counted below the pictures and in the figure of "
        "reductions on bases of round-off). The curved sheet has projections that matter."
    ),
    reads=(
        Chosen(MESH),
        Chosen(FULL_ORDER),
        Chosen(RERUNS),
        Chosen(SENSITIVITY),
        TableOf("noise"),
        Every(NOISE_RUNS),
        Setting("sensitivity.reference"),
        Setting("sensitivity.threshold"),
    ),
    options=ReducedRuns,
)
