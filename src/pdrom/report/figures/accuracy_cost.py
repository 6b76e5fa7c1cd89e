"""Accuracy of reduced models against their time per frame, by family and constraint group."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Methods, Scenes


class Options(Scenes, Methods):
    """What may be chosen; the first scene is drawn large."""


FIGURE = Declaration(
    title="What accuracy costs in time",
    caption=(
        "Error within the horizon against the time per frame of every reduced model, and of the "
        "full-order run with fewer iterations $K$; both against the scene's own full-order run, "
        "whose time is the vertical line. A colour is a family of models, a marker one of its "
        "members (one for all tolerances; hollow: in a subspace of skinning weights), a line the "
        "best trade-offs within the family: further down and further left is better. "
        "The horizontal line is the full-order run's own error, against the converged one: "
        "errors below it cannot be seen. Arrows on the rim are errors outside the axis, crosses "
        "runs that blew up. Below, a scene for each other constraint group."
    ),
    reads=(TableOf("accuracy_cost"), TableOf("reduced_reruns")),
    options=Options,
)
