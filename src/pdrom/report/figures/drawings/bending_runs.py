"""Runs of sheets with bending only, reduced, and on bases of round-off where that is all."""

from matplotlib.figure import Figure

from pdrom.report.figures.kit.camera import Camera
from pdrom.report.figures.kit.experiment_rows import experiment_rows
from pdrom.report.figures.kit.floor import Floors
from pdrom.report.figures.kit.noise_rows import COLUMNS, noise_rows
from pdrom.report.figures.kit.options import ReducedRuns
from pdrom.report.figures.kit.results import NothingToDraw, Results, asked
from pdrom.report.figures.kit.run_rows import NOTHING_RAN, Row, draw_rows


def draw(results: Results, options: ReducedRuns) -> Figure:
    """As `reduced_runs`; where all projections are round-off, runs on bases of it, if any.

    Raises
    ------
    StorageError
        A file of the results is missing or damaged.
    """
    experiments = results.experiments(options)
    if not experiments or not results.methods(options):
        raise NothingToDraw(asked(options))
    floors, noise = Floors(results), results.table("noise", COLUMNS)
    rows: list[Row] = []
    for scene, group in experiments:
        found = experiment_rows(results, options, floors, scene, group)
        own = noise[(noise.scene == scene) & (noise.group == group)]
        if found[0].note == NOTHING_RAN:
            found = noise_rows(results, options, floors, scene, group, own) or found
        rows += found
    return draw_rows(rows, Camera(options.azimuth, options.elevation))
