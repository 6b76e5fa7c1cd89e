"""What else there is: error against time of the alternatives to projective dynamics."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="Alternatives to projective dynamics",
    caption=(
        "Error against time per frame on the held-out motion, the best points of each method. Left "
        "of each pair the error against the implicit step of 16 ms solved to convergence, right "
        "the total error, against the motion in continuous time; the dashed line is the converged "
        "implicit step itself. Filled markers: one step a frame with more iterations; hollow ones: "
        "the frame divided into substeps. The reduction (ecsw) was trained on another motion. "
        "$\\times 100$: the same scene with stiffer weights. Errors outside are drawn on the rim."
    ),
    reads=(TableOf("alternatives"),),
    options=Scenes,
)
