"""Runs of sheets with bending only, reduced, and on bases of round-off where that is all."""

from matplotlib.figure import Figure

from pdrom.report.figures.kit.experiment_rows import draw_experiments, experiment_rows
from pdrom.report.figures.kit.floor import Floors
from pdrom.report.figures.kit.noise_rows import COLUMNS, noise_rows
from pdrom.report.figures.kit.options import ReducedRuns
from pdrom.report.figures.kit.results import Results
from pdrom.report.figures.kit.run_rows import NOTHING_RAN, Row


def draw(results: Results, options: ReducedRuns) -> Figure:
    """As `reduced_runs`; where all projections are round-off, runs on bases of it, if any.

    Raises
    ------
    StorageError
        A file of the results is missing or damaged.
    """
    noise = results.table("noise", COLUMNS)

    def rows_of(
        results: Results, options: ReducedRuns, floors: Floors, scene: str, group: str
    ) -> list[Row]:
        found = experiment_rows(results, options, floors, scene, group)
        if found[0].note != NOTHING_RAN:
            return found
        own = noise[(noise.scene == scene) & (noise.group == group)]
        return noise_rows(results, options, floors, scene, group, own) or found

    return draw_experiments(results, options, rows_of)
