"""The ladder: which choice breaks the reduction, and by how much."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="The ladder from the published choices to sound ones",
    caption=(
        "Above the line one ingredient after the other is changed, from the published code to "
        "whole elements with oversampling; below it each row takes a single ingredient away from "
        "the sound method or exchanges it. Left the error of the rerun within the horizon, right "
        "the gain of the interpolation; what blew up or is singular lies on the right rim. Bars "
        "show the range over runs that are trained on as many frames drawn anew, on some scenes; "
        "pale ones that over choices of the arbitrary signs of the singular vectors."
    ),
    reads=(TableOf("ladder"),),
    options=Scenes,
)
