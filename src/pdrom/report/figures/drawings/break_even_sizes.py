"""Break-even of reduced local steps against mesh size, with one thread and with two (claim C9)."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from pdrom.report.figures.break_even_sizes import Options
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import label_outer, small_multiples
from pdrom.report.figures.kit.results import NothingToDraw, Results
from pdrom.tables.break_even import CURVE

COLUMNS = [*CURVE, "vertices", "r", "ratio", "breakeven_r"]
LINES = {1: "-", 2: "--"}
PAYS, COSTS = "^", "v"


def draw(results: Results, options: Options) -> Figure:
    """A panel per scene, a line per method and number of threads over the meshes.

    Raises
    ------
    StorageError
        The table is missing or lacks a column.
    """
    points = _sizes(results.table("breakeven", COLUMNS))
    asked = options.scenes or tuple(dict.fromkeys(points.scene))
    scenes = [scene for scene in asked if (points.scene == scene).any()]
    if not scenes:
        raise NothingToDraw("no reduced local step was timed on several meshes")
    figure, axes = small_multiples(len(scenes), options.columns, legend_rows=2, height=1.9)
    styles = style.method_styles(results.methods(options))
    styles = {name: look for name, look in styles.items() if (points.method == name).any()}
    for ax, scene in zip(axes, scenes, strict=True):
        _draw_scene(ax, points[points.scene == scene], styles)
        ax.set_title(style.words(scene))
        ax.set_xlim(0.8 * points.vertices.min(), 1.25 * points.vertices.max())
    axes[0].set_ylim(bottom=0.0)
    label_outer(axes, options.columns, "vertices", "break-even size r")
    _legend(figure, results, styles)
    return figure


def _legend(figure: Figure, results: Results, styles: dict[str, tuple[str, str]]) -> None:
    handles = [
        Line2D([], [], color=colour, marker=marker, label=results.method_title(name))
        for name, (colour, marker) in styles.items()
    ]
    for threads, line in LINES.items():
        label = f"{threads} thread" + "s" * (threads > 1)
        handles.append(Line2D([], [], color=style.BLACK, linestyle=line, label=label))
    marks = {PAYS: "pays at the largest size tried", COSTS: "never pays"}
    for marker, label in marks.items():
        look = {"marker": marker, "markerfacecolor": "white", "linestyle": "none"}
        handles.append(Line2D([], [], color=style.BLACK, label=label, **look))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)


def _sizes(table: pd.DataFrame) -> pd.DataFrame:
    """One row per curve on scenes with several meshes: where it breaks even, or the last size."""
    several = table.groupby("scene").factor.transform("nunique") > 1
    rows = []
    for labels, curve in table[several].groupby(CURVE, sort=False):
        curve = curve.sort_values("r")
        first, size = curve.iloc[0], curve.breakeven_r.iloc[0]
        if pd.isna(size):
            size, mark = curve.r.iloc[-1], PAYS
        else:
            mark = COSTS if first.ratio >= 1.0 and size == first.r else ""
        rows.append((*labels, first.vertices, float(size), mark))
    return pd.DataFrame(rows, columns=[*CURVE, "vertices", "size", "mark"])


def _draw_scene(ax: Axes, points: pd.DataFrame, styles: dict[str, tuple[str, str]]) -> None:
    ax.set_xscale("log")
    ax.xaxis.set_minor_formatter(NullFormatter())
    style.grid(ax)
    # methods of the own mesh alone have no line to draw
    counts = points.groupby("method").factor.transform("nunique")
    for (name, threads), line in points[counts > 1].groupby(["method", "threads"], sort=False):
        if name not in styles:
            continue
        colour, marker = styles[str(name)]
        line = line.sort_values("vertices")
        look = {"color": colour, "linestyle": LINES[int(threads)], "linewidth": 1.1}
        ax.plot(line.vertices, line["size"], **look)
        for mark, part in line.groupby("mark"):
            face = "white" if mark else colour
            ax.plot(
                part.vertices, part["size"], mark or marker, color=colour, markersize=5,
                markerfacecolor=face,
            )  # fmt: skip
