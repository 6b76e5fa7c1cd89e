"""Shares of the time of a frame, by implementation (claim C1)."""

import numpy as np
import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Artist, Axes, Figure
from study.artifact.reads import Settings, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, Scenes

# the local step, whose share is printed, is what has a shade of orange
PHASES = {
    "local_ms": ("local step: projections", style.ORANGE),
    "assembly_ms": ("local step: right-hand side", "#F7D08A"),
    "global_ms": ("global solve", style.BLUE),
}
ORDER = ("interpreted", "numpy", "compiled")
TITLES = {"interpreted": "interpreted loop", "numpy": "vectorised NumPy", "compiled": "compiled"}
CLAIM = 70.0  # per cent, claim C1


@figure(
    title="Where the time of a frame goes",
    caption=(
        "Share of the local step and of the global solve in the time of a full-order frame, for "
        "three implementations of the same local step. The printed number is the share of the "
        "local step, that is of both shades of orange: the projections and the right-hand side "
        "that is assembled from them, in one pass where they are compiled. The dashed line is the "
        "70 % of claim C1; beside the bar stands the time per frame. An interpreted loop confirms "
        "the claim everywhere, compiled code only where projections are expensive."
    ),
    reads={"drawn": Settings(Drawn), "table": TableOf("local_share")},
    options=Scenes,
)
def local_share(options: Scenes, drawn: Drawn, table: pd.DataFrame) -> Figure:
    """Draw a panel per implementation, a bar per scene with the time per frame at its end."""
    scenes = drawn.scenes_of(table, "no timings")
    present = set(table[table.scene.isin(scenes)].implementation)
    implementations = [i for i in (*ORDER, *sorted(present - set(ORDER))) if i in present]
    figure = style.new_figure(0.27 * len(scenes) + 1.15)
    axes = figure.subplots(1, len(implementations), sharey=True, squeeze=False)[0]
    for ax, implementation in zip(axes, implementations, strict=True):
        rows = table[table.implementation == implementation].drop_duplicates("scene")
        _draw_bars(ax, rows.set_index("scene"), scenes)
        ax.set_title(TITLES.get(implementation, implementation))
        ax.set_xlabel("share of a frame (%)")
    style.label_rows(axes[0], [style.words(scene) for scene in scenes])
    handles: list[Artist] = [style.patch(label, color=c) for label, c in PHASES.values()]
    line = {"color": style.BLACK, "linestyle": "--"}
    handles.append(style.handle(f"{CLAIM:.0f} % (claim C1)", **line))
    style.legend(figure, handles, 4)
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
        words = f"{total:.2g} ms" if total < 99.5 else f"{total:.0f} ms"
        ax.text(102.0, y, words, va="center", ha="left", fontsize=7)
    ax.axvline(CLAIM, color=style.BLACK, linewidth=1.0, linestyle="--")
    ax.set_xlim(0, 100)
    ax.set_xticks([0, 25, 50, 75, 100])
    ax.tick_params(axis="y", length=0)
