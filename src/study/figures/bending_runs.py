"""Runs of sheets with bending only, reduced."""

from pdrom.view.artists import Figure
from pdrom.view.run_rows import NOTHING_RAN, Row
from study.artifact.paths import NOISE_RUNS
from study.artifact.reads import Every, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.experiment_rows import RUNS, draw_experiments, experiment_rows
from study.figures.kit.floor import Floors
from study.figures.kit.noise_rows import noise_rows
from study.figures.kit.options import ReducedRuns
from study.figures.kit.results import Results


@figure(
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
    reads=(*RUNS, TableOf("noise"), Every(NOISE_RUNS)),
    options=ReducedRuns,
)
def bending_runs(results: Results, options: ReducedRuns) -> Figure:
    """Draw reduced runs; where all projections are round-off, runs on bases of it, if any."""
    noise = results.table("noise")

    def rows_of(
        results: Results, options: ReducedRuns, floors: Floors, scene: str, group: str
    ) -> list[Row]:
        found = experiment_rows(results, options, floors, scene=scene, group=group)
        if found[0].note != NOTHING_RAN:
            return found
        own = noise[(noise.scene == scene) & (noise.group == group)]
        return noise_rows(results, options, floors, scene=scene, group=group, table=own) or found

    return draw_experiments(results, options, rows_of)
