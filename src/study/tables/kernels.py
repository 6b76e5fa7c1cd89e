"""Table kernels: what an element costs in each group's compiled local step."""

import pandas as pd

from study.artifact.reads import TableOf
from study.experiments.kit.names import GLOBAL, RIGHT
from study.tables.kit.declaration import compared, number, table, text, timed
from study.tables.kit.vocabulary import ELEMENTS, ROUNDING, SCENE, VERTICES
from study.tables.roofline import WHOLE

# columns of the table roofline and what they are called over the number of elements
_PER_ELEMENT = {
    "bytes": "bytes_per_element",
    "flops": "flops_per_element",
    "divisions": "divisions_per_element",
    "roots": "roots_per_element",
}


@table(
    title="Compiled projections: cost and accuracy of an element",
    columns=(
        text("group", "constraint group"),
        SCENE,
        compared("exact", number("factor", "on the vertices along a side of the scene's own mesh")),
        VERTICES,
        ELEMENTS,
        number("bytes_per_element", "arrays once, and lines that gathers fetch", "B"),
        compared(
            "timed",
            number("flops_per_element", "sums and products executed, idle lanes included"),
        ),
        compared("timed", number("divisions_per_element", "divisions executed")),
        compared("timed", number("roots_per_element", "square roots executed")),
        timed(number("ns_per_element", "time of gather, projection, forces and scatter", "ns")),
        timed(number("bound_ns", "least time on this machine", "ns")),
        timed(text("limit", "what the bound comes from")),
        timed(number("share", "the bound over the time")),
        compared(
            "share",
            number("worst_over_condition", "largest relative error over the condition number"),
            ROUNDING,
        ),
    ),
    reads={"phases": TableOf("roofline"), "accuracy": TableOf("kernel_accuracy")},
)
def kernels(phases: pd.DataFrame, accuracy: pd.DataFrame) -> pd.DataFrame:
    """One row per group, scene and mesh size of ``phases``, the table roofline.

    The ``accuracy`` is that of all matrices of the group.
    """
    rows = phases[~phases.phase.isin([RIGHT, GLOBAL, WHOLE])].rename(columns={"phase": "group"})
    for total, each in _PER_ELEMENT.items():
        rows[each] = rows[total] / rows.elements
    rows["ns_per_element"] = 1e3 * rows.measured_us / rows.elements
    rows["bound_ns"] = 1e3 * rows.bound_us / rows.elements
    worst = accuracy.groupby("group").worst_over_condition.max()
    rows["worst_over_condition"] = rows.group.map(worst)
    return rows.sort_values(["group", "scene", "factor"], kind="stable")
