"""Accuracy of reduced models against their time per frame, a panel per scene."""

from matplotlib.figure import Figure

from pdrom.report.figures.accuracy_cost_all import Options
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.legends import draw_legend, legend_height
from pdrom.report.figures.kit.multiples import label_outer
from pdrom.report.figures.kit.results import Results
from pdrom.report.figures.kit.trade_offs import draw_panel, group_title, handles, trade_offs

PANEL = 1.55  # inches, height of a panel
LEGEND_COLUMNS = 4


def draw(results: Results, options: Options) -> Figure:
    """Scenes with the same constraint group stand side by side.

    Raises
    ------
    StorageError
        A table is missing or lacks a column.
    """
    found, scenes = trade_offs(results, options)
    groups = list(dict.fromkeys(group_title(results, scene) for scene in scenes))
    scenes.sort(key=lambda scene: groups.index(group_title(results, scene)))
    columns = min(options.columns, len(scenes))
    rows = -(-len(scenes) // columns)
    blocks = handles(found, results)
    heights = [rows * PANEL + 0.2, legend_height(blocks, LEGEND_COLUMNS)]
    figure = Figure(figsize=(style.WIDTH, sum(heights)), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=heights)
    axes = upper.subplots(rows, columns, squeeze=False, sharey=True).ravel()
    for ax in axes[len(scenes) :]:
        ax.remove()
    for i, (ax, scene) in enumerate(zip(axes, scenes, strict=False)):
        draw_panel(ax, found, scene, results, size=2.2)
        ax.set_title(f"{group_title(results, scene)}:\n{style.words(scene)}", fontsize=7)
        ax.tick_params(labelleft=i % columns == 0)
    label_outer(list(axes[: len(scenes)]), columns, "time per frame (ms)", "relative error")
    draw_legend(lower, blocks, LEGEND_COLUMNS)
    return figure
