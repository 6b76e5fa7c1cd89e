"""Table roofline: the phases of an iteration against what the machine allows."""

import pandas as pd

from pdrom.core.store import read_table
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.experiments.roofline.bound import bounds
from study.tables.break_even import OWN_MESH
from study.tables.kit.declaration import compared, integer, number, table, text, timed
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import SCENE, VERTICES

WHOLE = "iteration"  # all phases together
_MESH = ["scene", "factor"]
_SUMS = ["bytes", "touches", "flops", "divisions", "roots", "bound_us", "measured_us"]


@table(
    title="Phases of an iteration against the bound of the machine",
    columns=(
        SCENE,
        compared("exact", number("factor", "on the vertices along a side of the scene's own mesh")),
        VERTICES,
        text("phase", f"group, right-hand side, global solve; {WHOLE}: all of them"),
        integer("elements", "elements of a group, else vertices"),
        number("bytes", "read and written: each array once, lines that gathers fetch", "B"),
        compared(
            "exact",
            integer("touches", "vectors that gathers and scatters load and store, in their order"),
        ),
        compared("timed", number("flops", "sums and products executed, idle lanes included")),
        compared("timed", number("divisions", "divisions executed")),
        compared("timed", number("roots", "square roots executed")),
        number("working_set", "all arrays of an iteration", "B"),
        timed(number("bandwidth", "of reading such a working set", "GB/s")),
        timed(text("limit", "what the bound comes from: the longest of three")),
        timed(number("bound_us", "least time of an iteration's phase on this machine", "us")),
        timed(number("measured_us", "its time, one thread", "us")),
        timed(number("share", "the bound over the measured time")),
    ),
    reads={
        "rates": Every(paths.RATES),
        "work": Every(paths.WORK),
        "own": Every(paths.EFFECTS),
        "sized": Every(paths.EFFECTS_SIZED),
    },
)
def roofline(
    rates: list[File], work: list[File], own: list[File], sized: list[File]
) -> pd.DataFrame:
    """One row per scene, mesh size and phase; the bound of an iteration is the sum of its phases'.

    A phase that was not timed inside the compiled loop, and an iteration with one, has no share.
    """
    phases = joined(work)
    if phases.empty:
        return phases
    times = pd.concat(
        [_times(file, 1.0) for file in own]
        + [_times(file, float(file["factor"])) for file in sized if file["factor"] != OWN_MESH]
    )
    phases = phases.merge(times, how="left", on=[*_MESH, "phase"])
    phases = pd.concat([phases, bounds(phases, joined(rates))], axis=1)
    whole = phases.groupby(_MESH, sort=False)
    sums = whole[["vertices", "working_set", "bandwidth"]].first()
    sums[_SUMS] = whole[_SUMS].agg(lambda column: column.sum(skipna=False))
    rows = pd.concat([phases, sums.reset_index().assign(phase=WHOLE)], ignore_index=True)
    order = rows.groupby(_MESH, sort=False).ngroup()
    rows = rows.iloc[order.argsort(kind="stable")]
    return rows.assign(share=rows.bound_us / rows.measured_us)


def _times(file: File, factor: float) -> pd.DataFrame:
    costs = read_table(file.path)
    return pd.DataFrame(
        {
            "scene": costs.scene,
            "factor": factor,
            "phase": costs.effect,
            "measured_us": costs.us_per_iteration,
        }
    )
