"""Break-even of reduced local steps against the mesh size (claim C9)."""

import pandas as pd

from pdrom.artifact.reads import TableOf
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Axes, Figure
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.multiples import label_outer, no_minor_labels, small_multiples
from pdrom.report.figures.kit.options import Columns, Methods, Scenes
from pdrom.report.figures.kit.results import NothingToDraw, Results
from pdrom.tables.break_even import CURVE

LINES = {1: "-", 2: "--"}
PAYS, COSTS = "^", "v"


class Options(Scenes, Methods, Columns):
    """Choices."""


@figure(
    title="Break-even on finer meshes",
    caption=(
        "Smallest $r$ from which the reduced local step costs as much as the full one, over the "
        "number of vertices, with the full step and the reconstruction on one thread and on two. "
        "The first "
        "mesh is the scene's own; its basis is that of the study, those of the finer ones come "
        "from the first frames of a run."
    ),
    reads=(TableOf("breakeven"),),
    options=Options,
)
def break_even_sizes(results: Results, options: Options) -> Figure:
    """Draw a panel per scene, a line per method and number of threads over the meshes."""
    points = _sizes(results.table("breakeven"))
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
    label_outer(axes, options.columns, "vertices", y="break-even size r")
    _legend(figure, results, styles)
    return figure


def _legend(figure: Figure, results: Results, styles: dict[str, tuple[str, str]]) -> None:
    handles = style.method_handles(results, styles)
    for threads, line in LINES.items():
        label = f"{threads} thread" + "s" * (threads > 1)
        handles.append(style.handle(label, color=style.BLACK, linestyle=line))
    marks = {
        "pays at the largest size tried": (style.BLACK, PAYS),
        "never pays": (style.BLACK, COSTS),
    }
    handles += style.handles(marks, markerfacecolor="white", linestyle="none")
    style.legend(figure, handles, 3)


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
    no_minor_labels(ax)
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
