"""Where the time of a frame goes, by implementation (claim C1)."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.options import Scenes
from pdrom.report.figures.kit.results import NothingToDraw, Results

# the local step, whose share is printed, is what has a shade of orange
PHASES = {
    "local_ms": ("local step: projections", style.ORANGE),
    "assembly_ms": ("local step: right-hand side", "#F7D08A"),
    "global_ms": ("global solve", style.BLUE),
}
COLUMNS = ["scene", "implementation", *PHASES, "local_share"]
ORDER = ("interpreted", "numpy", "compiled")
TITLES = {"interpreted": "interpreted loop", "numpy": "vectorised NumPy", "compiled": "compiled"}
CLAIM = 70.0  # per cent, claim C1


def draw(results: Results, options: Scenes) -> Figure:
    """A panel per implementation, a bar per scene; the time per frame is printed at its end.

    Raises
    ------
    StorageError
        The table is missing or lacks a column.
    """
    table = results.table("local_share", COLUMNS)
    held = results.scenes(options)
    scenes = [scene for scene in held if (table.scene == scene).any()]
    present = set(table[table.scene.isin(scenes)].implementation)
    implementations = [i for i in (*ORDER, *sorted(present - set(ORDER))) if i in present]
    if not scenes or not implementations:
        raise NothingToDraw("no timings")
    height = 0.27 * len(scenes) + 1.15
    figure = Figure(figsize=(style.WIDTH, height), layout="constrained")
    axes = figure.subplots(1, len(implementations), sharey=True, squeeze=False)[0]
    for ax, implementation in zip(axes, implementations, strict=True):
        rows = table[table.implementation == implementation].drop_duplicates("scene")
        _draw_bars(ax, rows.set_index("scene"), scenes)
        ax.set_title(TITLES.get(implementation, implementation))
        ax.set_xlabel("share of a frame (%)")
    axes[0].set_yticks(range(len(scenes)), [style.words(scene) for scene in scenes])
    axes[0].set_ylim(len(scenes) - 0.4, -0.6)
    _legend(figure)
    return figure


def _draw_bars(ax: Axes, rows: pd.DataFrame, scenes: list[str]) -> None:
    for y, scene in enumerate(scenes):
        if scene not in rows.index:
            continue
        times = rows.loc[scene, list(PHASES)].to_numpy(float)
        total = np.nansum(times)
        start = 0.0
        for time, (_, colour) in zip(times, PHASES.values(), strict=True):
            share = 100.0 * np.nan_to_num(time) / total
            ax.barh(y, share, left=start, color=colour, height=0.72)
            start += share
        printed = f"{100.0 * rows.local_share[scene]:.0f} %"
        ax.text(2.0, y, printed, va="center", ha="left", fontsize=7.5, fontweight="bold")
        ax.text(102.0, y, _milliseconds(total), va="center", ha="left", fontsize=7)
    ax.axvline(CLAIM, color=style.BLACK, linewidth=1.0, linestyle="--")
    ax.set_xlim(0, 100)
    ax.set_xticks([0, 25, 50, 75, 100])
    ax.tick_params(axis="y", length=0)


def _milliseconds(value: float) -> str:
    """Time of a frame with two significant digits."""
    return f"{value:.2g} ms" if value < 99.5 else f"{value:.0f} ms"


def _legend(figure: Figure) -> None:
    handles: list = [Patch(color=colour, label=label) for label, colour in PHASES.values()]
    handles.append(
        Line2D([], [], color=style.BLACK, linestyle="--", label=f"{CLAIM:.0f} % (claim C1)")
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
