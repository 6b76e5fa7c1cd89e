"""How far runs drift apart that start almost alike, and the horizon that follows."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pdrom.model.runs.horizon import floor_of, horizon
from pdrom.report.figures import style
from pdrom.report.figures.floor import read_sensitivity
from pdrom.report.figures.multiples import clipped, label_outer, log_axis, small_multiples
from pdrom.report.figures.sources import Sources
from pdrom.report.figures.spec import FigureSpec

LOW, HIGH = 1e-12, 1e2
TWIN = "_twin"


@style.styled
def draw(sources: Sources, spec: FigureSpec) -> Figure:
    """A panel per kind of scene, a line per scene: its spread under a perturbed start.

    The grey line is the threshold; a dot marks the frame at which a scene crosses it, its horizon,
    given in the legend. A twin has the colour of its scene and is dashed.

    Raises
    ------
    StorageError
        The table is missing or lacks a column.
    """
    table = read_sensitivity(sources)
    kinds: dict[str, list] = {}
    for scene in dict.fromkeys(s for s, _ in sources.holdings.experiments(spec.scenes)):
        floor = floor_of(table, scene, spec.perturbation)
        if len(floor):
            kinds.setdefault(_kind(sources, scene), []).append((scene, floor))
    if not kinds:
        return style.no_data(f"no run perturbed by {spec.perturbation:g}")
    columns = min(spec.columns, len(kinds))
    figure, axes = small_multiples(len(kinds), columns, height=2.7)
    for ax, (kind, scenes) in zip(axes, kinds.items(), strict=True):
        log_axis(ax, LOW, HIGH)
        ax.axhline(spec.threshold, color=style.GREY, linewidth=0.9)
        colours = _colours([scene for scene, _ in scenes])
        for scene, floor in scenes:
            _draw_scene(ax, scene, floor, colours[scene], spec.threshold)
        ax.set_title(kind)
        ax.legend(
            loc="upper center", bbox_to_anchor=(0.5, -0.31), fontsize=7.5, handlelength=1.6,
            labelspacing=0.25,
        )  # fmt: skip
    label_outer(axes, columns, "frame", "relative difference")
    for ax in axes:
        ax.set_xlabel("frame")
    handles = [
        Line2D([], [], color=style.GREY, label=f"threshold {spec.threshold:g}"),
        Line2D(
            [], [], color="#555555", marker="o", linestyle="none", label="horizon (frame given)"
        ),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _kind(sources: Sources, scene: str) -> str:
    groups = sources.holdings.scenes[scene].groups
    if len(groups) > 1:
        return "all groups"
    return "volume" if groups[0] in ("deformation_gradient", "tetrahedron_strain") else groups[0]


def _colours(scenes: list[str]) -> dict[str, str]:
    """Colour of each scene; a twin shares that of its scene."""
    families = list(dict.fromkeys(scene.removesuffix(TWIN) for scene in scenes))
    colours = {name: style.CYCLE[i % len(style.CYCLE)] for i, name in enumerate(families)}
    return {scene: colours[scene.removesuffix(TWIN)] for scene in scenes}


def _draw_scene(ax: Axes, scene: str, floor: np.ndarray, colour: str, threshold: float) -> None:
    end = horizon(floor, threshold)
    crossed = end < len(floor)
    label = f"{style.words(scene)}: {end if crossed else f'beyond {end}'}"
    shown = clipped(floor, LOW, HIGH)
    line = "--" if scene.endswith(TWIN) else "-"
    ax.plot(np.arange(len(floor)), shown, color=colour, label=label, linestyle=line)
    if crossed:
        ax.plot([end], [threshold], color=colour, marker="o", markersize=4.5, zorder=5)
