"""Accuracy of reduced models against their time per frame, scene by scene."""

from pdrom.artifact.reads import TableOf
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Figure
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.legends import draw_legend, legend_height
from pdrom.report.figures.kit.multiples import label_outer, panels, rows_of
from pdrom.report.figures.kit.options import Columns, Methods, Scenes
from pdrom.report.figures.kit.results import Results
from pdrom.report.figures.kit.trade_offs import draw_panel, group_title, handles, trade_offs

PANEL = 1.55  # inches, height of a panel
LEGEND_COLUMNS = 4


class Options(Scenes, Methods, Columns):
    """Choices."""


@figure(
    title="What accuracy costs in time, scene by scene",
    caption=(
        "Error within the horizon against the time per frame, both relative to the scene's own "
        "full-order run, scenes by their constraint group. A colour is a family of models, a "
        "marker one of its members (one for all tolerances; hollow: in a subspace of skinning "
        "weights), a line the best trade-offs within the family; the lines of the full-order run "
        "are its time and its own error. Arrows on the rim are errors outside the axis: where "
        "several groups are active, the reduction of a weak one changes next to nothing. Crosses "
        "are runs that blew up before they had an error."
    ),
    reads=(TableOf("accuracy_cost"), TableOf("reduced_reruns")),
    options=Options,
)
def accuracy_cost_all(results: Results, options: Options) -> Figure:
    """Draw a panel per scene; those with the same constraint group stand side by side."""
    found, scenes = trade_offs(results, options)
    groups = list(dict.fromkeys(group_title(results, scene) for scene in scenes))
    scenes.sort(key=lambda scene: groups.index(group_title(results, scene)))
    blocks = handles(found, results)
    heights = [
        rows_of(len(scenes), options.columns) * PANEL + 0.2,
        legend_height(blocks, LEGEND_COLUMNS),
    ]
    figure = style.new_figure(sum(heights))
    upper, lower = figure.subfigures(2, 1, height_ratios=heights)
    axes = panels(upper, len(scenes), options.columns, sharey=True)
    for ax, scene in zip(axes, scenes, strict=True):
        draw_panel(ax, found, scene, results=results, size=2.2)
        ax.set_title(f"{group_title(results, scene)}:\n{style.words(scene)}", fontsize=7)
    label_outer(axes, options.columns, "time per frame (ms)", y="relative error")
    draw_legend(lower, blocks, LEGEND_COLUMNS)
    return figure
