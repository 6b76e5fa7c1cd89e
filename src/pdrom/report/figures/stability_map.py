"""The stability map: how every reduced run of the study ended."""

from pdrom.core.reads import Setting, TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Experiments, Methods, Ranks


class Options(Experiments, Methods, Ranks):
    """What may be chosen."""


FIGURE = Declaration(
    title="Where each method can be trusted",
    caption=(
        "How every run on the training motion ended, by method, size and scene. Accurate or "
        "wrong: the error within the horizon is at most, or above, {stability.wrong}; left the "
        "scene: the bounding box exceeds {stability.left} times the largest one of the full-order "
        "run; blow-up: numbers that are not finite, or an extent beyond the limit, in the printed "
        "frame. Groups whose projections are round-off are left out."
    ),
    reads=(
        TableOf("stability"),
        Setting("stability.wrong"),
        Setting("stability.left"),
    ),
    options=Options,
)
