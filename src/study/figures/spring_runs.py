"""Runs of sheets with springs only, reduced."""

from pdrom.view.artists import Figure
from study.figures.kit.declaration import figure
from study.figures.kit.experiment_rows import RUNS, draw_experiments
from study.figures.kit.options import ReducedRuns
from study.figures.kit.results import Results


@figure(
    number=6,
    title="Springs only, reduced",
    caption=(
        "Sheets with edge springs only: full order against reduced projections, by basis size. "
        "The grey outline is the full-order run at the same instant; a framed picture is drawn to "
        "the smaller scale given below it."
    ),
    reads=RUNS,
    options=ReducedRuns,
)
def spring_runs(results: Results, options: ReducedRuns) -> Figure:
    """Draw full-order runs beside reduced ones, see `draw_experiments`."""
    return draw_experiments(results, options)
