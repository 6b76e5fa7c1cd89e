"""Does the gain of an interpolation predict whether the run fails?"""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Experiments, Methods


class Options(Experiments, Methods):
    """What may be chosen."""


FIGURE = Declaration(
    title="Error of the run against the gain",
    caption=(
        "Left: every run of a sampled method whose basis suffices (the orthogonal projection does "
        "not fail at the same size), over all scenes and sizes. Dashed: the error from which on a "
        "run counts as failed; dotted: the gain that separates failed runs from others with the "
        "fewest mistakes. Arrows on the rim lie outside the axes. Crosses: range and median over "
        "runs, in some scenes, that are trained on as many frames drawn anew. Right: how many of "
        "them failed, by decade of the gain."
    ),
    reads=(
        TableOf("reduced_reruns"),
        TableOf("reconstruction_error"),
        TableOf("gain_prediction"),
        TableOf("repetitions"),
    ),
    options=Options,
)
