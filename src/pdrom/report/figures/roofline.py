"""The phases of an iteration against what the machine allows."""

from pdrom.core.reads import TableOf
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="An iteration against the bound of the machine",
    caption=(
        "Left: bytes read a second by one thread against the working set (median and quartiles), "
        "with the smallest cache that holds it; ticks below are the working sets of the scenes' "
        "iterations. Right: time of each phase of an iteration, on the scenes' own meshes and on "
        "finer ones, against its bound: the longest of the times for bytes, for sums and products, "
        "and for divisions and roots. Filled markers are bound by bytes, hollow ones by "
        "arithmetic. "
        "No point can lie below the diagonal but for the spread of the measurement."
    ),
    reads=(TableOf("machine_rates"), TableOf("roofline")),
    options=Scenes,
)
