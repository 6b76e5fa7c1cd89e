"""Error of a scene's reduced runs against time, with its sensitivity floor and horizon."""

from collections.abc import Mapping

from matplotlib.figure import Figure

from pdrom.report.figures.run_error import Options, run_error
from pdrom.report.scenes.picture import write_picture
from pdrom.report.scenes.results import SceneResults

SIZES = (20, "full")


def make(results: SceneResults, outputs: Mapping[str, str]) -> None:
    """Write the picture."""
    write_picture(draw, results, "error against time", outputs)


def draw(results: SceneResults) -> Figure:
    """A panel per group; see the study's figure of this kind, which draws it."""
    options = Options(scenes=(results.scene,), ranks=SIZES, columns=2)
    return run_error.function(results, options)
