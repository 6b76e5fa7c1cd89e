"""Tools of a scene's pictures: choice of runs, colours, panels, files."""

from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.effects import EFFECTS
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.output import write_figure
from pdrom.report.figures.kit.panels import RunPanel
from pdrom.report.viewer.runs import ViewedRun, ViewedScene
from pdrom.report.words.text import plain_words

SHOWN = 20  # modes


def shown(sizes: Sequence[ViewedRun]) -> ViewedRun:
    """Choose the largest of some sizes (ascending) up to `SHOWN`, else the smallest."""
    return ([run for run in sizes if run.r <= SHOWN] or sizes[:1])[-1]


def shown_runs(scene: ViewedScene) -> list[ViewedRun]:
    """One run of each group and method of ``scene``, of the size that pictures show."""
    pairs = dict.fromkeys((run.group, run.method) for run in scene.runs)
    return [shown(scene.sizes(*pair)) for pair in pairs]


def title_of(scene: ViewedScene, run: ViewedRun) -> str:
    """Method and size of ``run``, below the group where ``scene`` reduces several."""
    group = f"{style.words(run.group)}\n" if len(scene.groups) > 1 else ""
    return f"{group}{plain_words(run.title)}\nr = {run.r}"


def panel_of(run: ViewedRun, frame: int, title: str = "") -> RunPanel:
    """Panel of ``run`` at ``frame``, or at its last one with what went wrong, with a ``title``."""
    last = len(run.positions) - 1
    failure = f"blew up at frame {run.blowup_frame}" if run.blowup_frame is not None else "ended"
    positions = run.positions[min(frame, last)].astype(float)
    return RunPanel(title, _colour(run.group), positions, failure if frame > last else None)


def _colour(group: str) -> tuple[float, float, float]:
    """Colour of a constraint group, by its place among all."""
    groups = [name for name in EFFECTS if issubclass(EFFECTS.load(name), ConstraintGroup)]
    looks = style.GROUP_LOOKS
    return style.surface_colour(looks[groups.index(group) % len(looks)][0])


def write_picture(
    draw: Callable[[ViewedScene], Figure], scene: ViewedScene, title: str, pdf: Path, png: Path
) -> None:
    """``draw`` the ``scene`` in the style of the study's figures; write ``pdf`` and ``png``.

    The ``title`` is that of the PDF.
    """
    with style.look():
        figure = draw(scene)
    write_figure(figure, f"{scene.name}: {title}", pdf, png=png, with_checksum=False)
