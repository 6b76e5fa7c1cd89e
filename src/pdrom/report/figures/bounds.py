"""How far may a reduced run go, how far does it, and does its iteration contract?"""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Experiments, Methods


class Options(Experiments, Methods):
    """What may be chosen."""


FIGURE = Declaration(
    title="Bounds known before a run",
    caption=(
        "Left: the largest extent of every run against its a-priori bound (theorem 1), both in "
        "rest extents. On the line they are equal; where no contact acts, no dot may lie above it. "
        "Ringed: what the study "
        "calls a blow-up. Right: the error of every run whose basis suffices "
        "against the contraction number of its iteration, over all scenes with a single group. "
        "Left of the dotted line an error shrinks in every iteration. Dashed: the error from "
        "which on a run counts as failed. Arrows on the rim lie outside the axes."
    ),
    reads=(
        TableOf("bounds"),
        TableOf("reduced_reruns"),
        TableOf("reconstruction_error"),
    ),
    options=Options,
)
