"""Which verdicts stand when their rules change."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Options

FIGURE = Declaration(
    title="Fragile verdicts",
    caption=(
        "Verdicts on the claims, as published and beyond, when their rules change: each cell holds "
        "the variations that give another verdict, of all of this kind. Thresholds are multiplied "
        "by factors from a half to two, the share of rows that must agree goes from a half to one, "
        "the margin within which ratios of times decide nothing from none to a factor five, "
        "sizes are the small or the large ones only, splits the training frames, those between "
        "them or the held-out ones, and scenes are left out one at a time. An empty cell: the "
        "variation does not exist. A row without colour is a verdict that does not hang on its "
        "rule."
    ),
    reads=(TableOf("claims_sensitivity"),),
    options=Options,
)
