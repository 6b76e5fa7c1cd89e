"""Runs of sheets with bending only, reduced."""

from pdrom.core.paths import FULL_ORDER, MESH, RERUNS, SENSITIVITY
from pdrom.core.reads import Chosen, Setting
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import ReducedRuns

FIGURE = Declaration(
    number=5,
    title="Bending only, reduced",
    caption=(
        "Sheets with bending constraints only, near the end of the run: full order against "
        "reduced projections. The projections of a flat sheet are round-off, so that there is "
        "nothing to reduce in the paper's two scenes (what bases of that noise do is counted in "
        "`noise_runs`); the curved sheet has projections that matter."
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
