"""Where each method can be trusted over the time step and over the stiffness."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Methods, Scenes


class Options(Scenes, Methods):
    """What may be chosen."""


FIGURE = Declaration(
    title="Time step and stiffness",
    caption=(
        "How short runs at other time steps and with other weights of the reduced group ended. "
        "Bases and samplings are those of the scene's own setting, marked by a triangle; the "
        "full-order run that each is compared with has the same setting."
    ),
    reads=(TableOf("stability"),),
    options=Options,
)
