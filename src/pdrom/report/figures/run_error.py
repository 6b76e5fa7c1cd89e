"""Error of reduced runs against time, with the sensitivity floor behind it."""

import numpy as np
import pandas as pd

from pdrom.artifact.reads import Chosen, Every, TableOf
from pdrom.core.paths import REPEATED_FRAMES, RERUNS
from pdrom.core.store import read_table
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Axes, Figure
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.floor import FLOORS, Floors
from pdrom.report.figures.kit.multiples import clipped, label_outer, log_axis, small_multiples
from pdrom.report.figures.kit.options import Columns, Experiments, Methods, Ranks
from pdrom.report.figures.kit.read import RerunInfo, choose_ranks, rerun_errors, rerun_infos
from pdrom.report.figures.kit.results import NothingToDraw, Results, asked

Pair = tuple[str, str]  # scene and group
LOW, HIGH = 1e-7, 1e3
LINES = ("--", "-", ":", "-.")
FLOOR = "#DDD9D0"
DOTS = (0, (1, 1.5))  # line of the horizon
TRAINED = "training"  # what differs between the runs of a band: the frames that train them
ENDS = ("low", "high")
FRAMES = ["method", "r", "varied", "frame", *(f"error_{end}" for end in ENDS)]


class Options(Experiments, Methods, Ranks, Columns):
    """Choices."""


@figure(
    title="Error of reduced runs against time",
    caption=(
        "Relative error of reduced runs frame by frame. The shaded area is the sensitivity floor "
        "of the scene and the dotted line its horizon: errors to the right of it cannot be told "
        "from chaos. Bands in the colour of a method, in some scenes and up to the horizon, hold "
        "the same runs trained on as many resampled frames."
    ),
    reads=(Chosen(RERUNS), TableOf("repetitions"), Every(REPEATED_FRAMES), *FLOORS),
    options=Options,
)
def run_error(results: Results, options: Options) -> Figure:
    """Draw a panel per experiment, a line per method and basis size.

    A cross ends a run that blew up. Behind a line lies the band of its repetitions, where there
    are any. Experiments without a reduced run are left out; errors outside the axis lie on its rim.
    """
    floors = Floors(results)
    methods = results.methods(options)
    pairs = results.experiments(options)
    if not pairs or not methods:
        raise NothingToDraw(asked(options))
    pairs = [pair for pair in pairs if any(_ran(results, *pair, m, options) for m in methods)]
    if not pairs:
        raise NothingToDraw("no reduced run: all projections are round-off")
    bands = _bands(results, pairs)
    figure, axes = small_multiples(len(pairs), options.columns, legend_rows=2)
    for ax, (scene, group) in zip(axes, pairs, strict=True):
        log_axis(ax, LOW, HIGH)
        _draw_floor(ax, floors.of(scene), floors.horizon(scene))
        for method in methods:
            runs = _ran(results, scene, group, method, options)
            if (scene, group) in bands:
                _draw_bands(ax, bands[scene, group], runs, method)
            _draw_runs(ax, results.path(RERUNS, scene, group, method), runs, options.ranks, method)
        ax.set_title(results.experiment_title(scene, group))
        ax.set_xlim(0, None)
    label_outer(axes, options.columns, "frame", y="relative error")
    _legend(figure, results, methods, options.ranks, bool(bands))
    return figure


def _bands(results: Results, pairs: list[Pair]) -> dict[Pair, pd.DataFrame]:
    """Ranges over other training frames by method, size and frame, where runs were repeated."""
    table = results.table("repetitions")
    table = table[table.varied == TRAINED]
    repeated = set(zip(table.scene, table.group, strict=True))
    bands = {}
    for pair in repeated.intersection(pairs):
        table = read_table(results.path(REPEATED_FRAMES, *pair), FRAMES)
        bands[pair] = table[table.varied == TRAINED]
    return bands


def _draw_bands(ax: Axes, bands: pd.DataFrame, runs: list[RerunInfo], method: str) -> None:
    colour, _ = style.method_styles([method])[method]
    for info in runs:
        band = bands[(bands.method == method) & (bands.r == info.r)]
        low, high = (clipped(band[f"error_{end}"].to_numpy(float), LOW, HIGH) for end in ENDS)
        ax.fill_between(band.frame, low, high, color=colour, alpha=0.2, linewidth=0.0, zorder=1.5)


def _draw_floor(ax: Axes, floor: np.ndarray, end: int | None) -> None:
    if len(floor) == 0:
        return
    frames, shown = np.arange(len(floor)), clipped(floor, LOW, HIGH)
    ax.fill_between(frames, LOW, shown, color=FLOOR, linewidth=0.0, zorder=0)
    if end is not None:
        ax.axvline(end, color="#8A857A", linewidth=0.8, linestyle=DOTS, zorder=1)


def _ran(
    results: Results, scene: str, group: str, method: str, options: Options
) -> list[RerunInfo]:
    """Reduced runs of the requested sizes; without those whose size exceeds the numerical rank."""
    infos = choose_ranks(rerun_infos(results.path(RERUNS, scene, group, method)), options.ranks)
    return [info for info in infos if not info.marked]


def _draw_runs(
    ax: Axes, path: str, infos: list[RerunInfo], ranks: tuple[int | str, ...], method: str
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
    figure: Figure,
    results: Results,
    methods: list[str],
    ranks: tuple[int | str, ...],
    bands: bool,
) -> None:
    handles: list = []
    for method, (colour, _) in style.method_styles(methods).items():
        handles.append(style.handle(results.method_title(method), color=colour))
    for line, rank in zip(LINES, ranks, strict=False):
        label = "full rank" if rank == "full" else f"r = {rank}"
        handles.append(style.handle(label, color="#555555", linestyle=line))
    cross = {"linestyle": "none", "marker": "x", "markeredgewidth": 1.3, "markersize": 5}
    handles.append(style.handle("blew up", color="#555555", **cross))
    if bands:
        handles.append(style.patch("other training frames", color="#555555", alpha=0.2))
    handles.append(style.patch("sensitivity floor", color=FLOOR))
    handles.append(style.handle("horizon", color="#8A857A", linestyle=DOTS))
    style.legend(figure, handles, 4)
