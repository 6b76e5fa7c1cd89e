"""Full-order runs beside reduced ones (figures 4 to 7 of the preprint, and the bars)."""

from matplotlib.figure import Figure

from pdrom.report.figures.kit.experiment_rows import draw_experiments, experiment_rows
from pdrom.report.figures.kit.options import ReducedRuns
from pdrom.report.figures.kit.results import Results


def draw(results: Results, options: ReducedRuns) -> Figure:
    """One row per experiment and method: the full-order run, then the reduced ones by size.

    All pictures of an experiment show the same instant, the last one of ``options.frames``,
    with the same camera; one that does not fit is framed and its scale is given. The grey outline
    is the full-order run. An experiment without any reduced run has a single row that says so.

    Raises
    ------
    StorageError
        A file of the results is missing or damaged.
    """
    return draw_experiments(results, options, experiment_rows)
