"""Writing a picture of a scene, or a note where there is nothing to draw."""

from collections.abc import Callable, Mapping

from matplotlib.figure import Figure

from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.output import write_figure
from pdrom.report.figures.kit.results import NothingToDraw
from pdrom.report.scenes.results import SceneResults


def write_picture(
    draw: Callable[[SceneResults], Figure],
    results: SceneResults,
    title: str,
    outputs: Mapping[str, str],
) -> None:
    """Draw in the style of the study's figures and write ``pdf`` and ``png`` of ``outputs``."""
    with style.look():
        try:
            figure = draw(results)
        except NothingToDraw as nothing:
            figure = style.note(f"{results.scene}: {nothing}")
    write_figure(figure, f"{results.scene}: {title}", outputs["pdf"], outputs["png"])
