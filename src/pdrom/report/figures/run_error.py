"""Error of reduced runs against time, with the sensitivity floor behind it."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pdrom.model.runs.horizon import floor_of, horizon
from pdrom.report.figures import style
from pdrom.report.figures.floor import read_sensitivity
from pdrom.report.figures.multiples import clipped, label_outer, log_axis, small_multiples
from pdrom.report.figures.read import RerunInfo, choose_ranks, rerun_errors, rerun_infos
from pdrom.report.figures.sources import Sources
from pdrom.report.figures.spec import FigureSpec

LOW, HIGH = 1e-7, 1e3
LINES = ("--", "-", ":", "-.")
FLOOR = "#DDD9D0"


@style.styled
def draw(sources: Sources, spec: FigureSpec) -> Figure:
    """A panel per experiment, a line per method and basis size; a cross ends a run that blew up.

    Experiments without a reduced run are left out; errors outside the axis lie on its rim.

    Raises
    ------
    StorageError
        A file of the results is missing or damaged.
    """
    table = read_sensitivity(sources)
    methods = sources.holdings.methods(spec.methods)
    pairs = sources.holdings.experiments(spec.scenes, spec.groups)
    if not pairs or not methods:
        return style.no_data(f"{', '.join(spec.scenes)} with {', '.join(spec.methods)}")
    pairs = [pair for pair in pairs if any(_ran(sources, *pair, m, spec) for m in methods)]
    if not pairs:
        return style.no_data("no reduced run: all projections are round-off")
    figure, axes = small_multiples(len(pairs), spec.columns, legend_rows=2)
    for ax, (scene, group) in zip(axes, pairs, strict=True):
        log_axis(ax, LOW, HIGH)
        floor = floor_of(table, scene, spec.perturbation)
        _draw_floor(ax, floor, spec.threshold)
        for method in methods:
            runs = _ran(sources, scene, group, method, spec)
            _draw_runs(ax, sources.rerun(scene, group, method), runs, spec.ranks, method)
        ax.set_title(sources.title(scene, group))
        ax.set_xlim(0, None)
    label_outer(axes, spec.columns, "frame", "relative error")
    _legend(figure, sources, methods, spec.ranks)
    return figure


def _draw_floor(ax: Axes, floor: np.ndarray, threshold: float) -> None:
    if len(floor) == 0:
        return
    shown = clipped(floor, LOW, HIGH)
    ax.fill_between(np.arange(len(floor)), LOW, shown, color=FLOOR, linewidth=0.0, zorder=0)
    end = horizon(floor, threshold)
    if end < len(floor):
        ax.axvline(end, color="#8A857A", linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=1)


def _ran(
    sources: Sources, scene: str, group: str, method: str, spec: FigureSpec
) -> list[RerunInfo]:
    """Reduced runs of the asked sizes; without those whose size exceeds the numerical rank."""
    infos = choose_ranks(rerun_infos(sources.rerun(scene, group, method)), spec.ranks)
    return [info for info in infos if not info.marked]


def _draw_runs(
    ax: Axes, path: Path, infos: list[RerunInfo], ranks: tuple[int | str, ...], method: str
) -> None:
    colour, _ = style.method_styles([method])[method]
    for info in infos:
        error = rerun_errors(path, info)
        frames = np.arange(1, len(error) + 1)
        shown = clipped(np.where(np.isfinite(error), error, HIGH), LOW, HIGH)
        ax.plot(frames, shown, color=colour, linestyle=_line(info, ranks), linewidth=1.0)
        if info.blowup_frame >= 0 and len(error):
            ax.plot(
                frames[-1:], shown[-1:], marker="x", markersize=5, markeredgewidth=1.3,
                color=colour, clip_on=False, zorder=6,
            )  # fmt: skip


def _line(info: RerunInfo, ranks: tuple[int | str, ...]) -> str:
    """Line style of a basis size: its place in ``ranks``."""
    for place, rank in enumerate(ranks):
        if info.full if rank == "full" else info.r == rank:
            return LINES[place % len(LINES)]
    return LINES[1]


def _legend(
    figure: Figure, sources: Sources, methods: list[str], ranks: tuple[int | str, ...]
) -> None:
    handles: list = []
    for method, (colour, _) in style.method_styles(methods).items():
        handles.append(Line2D([], [], color=colour, label=sources.holdings.title(method)))
    for line, rank in zip(LINES, ranks, strict=False):
        label = "full rank" if rank == "full" else f"r = {rank}"
        handles.append(Line2D([], [], color="#555555", linestyle=line, label=label))
    cross = {"linestyle": "none", "marker": "x", "markeredgewidth": 1.3, "markersize": 5}
    handles.append(Line2D([], [], color="#555555", label="blew up", **cross))
    handles.append(Patch(color=FLOOR, label="sensitivity floor"))
    dots = {"color": "#8A857A", "linestyle": (0, (1, 1.5))}
    handles.append(Line2D([], [], label="horizon", **dots))
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
