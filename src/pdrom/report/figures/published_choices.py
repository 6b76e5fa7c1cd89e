"""Reconstruction errors on the way from this study's `published` to the published code's output."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="This study's error and the published code's, choice by choice",
    caption=(
        "Relative error of the reconstructed training snapshots, $x$ components, against the "
        "number $r$ of basis vectors. Grey: what the published code wrote itself. Dashed: the "
        "method with its choices of basis and rows, as in this study. Green: with one more of its "
        "choices, the one that alone leads closest and that stands above. Blue: with all of them. "
        "The pale band holds "
        "all runs in which what rounding decides is drawn at random: the signs of the modes, or "
        "which of several rows with equal residuals is picked; dotted, the closest of these runs."
    ),
    reads=(TableOf("published_choices"), TableOf("published_distance")),
    options=Scenes,
)
