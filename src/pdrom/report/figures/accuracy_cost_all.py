"""Accuracy of reduced models against their time per frame, scene by scene."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Columns, Methods, Scenes


class Options(Scenes, Methods, Columns):
    """What may be chosen."""


FIGURE = Declaration(
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
