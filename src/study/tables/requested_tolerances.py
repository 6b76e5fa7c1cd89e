"""Table requested_tolerances: runs within a tolerance, on motions that no calibration has seen."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, flag, integer, number, table, text, timed
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import MS_PER_FRAME, SCENE, VERTICES


@table(
    title="Requested tolerances and errors reached",
    columns=(
        SCENE,
        text("motion", "held-out motion that was run"),
        compared("exact", number("tolerance", "largest relative error of the positions requested")),
        VERTICES,
        compared("error", flag("met", "the run says that it is within the tolerance")),
        compared("error", integer("frames", "first frames for which it says so")),
        compared("error", flag("reduced", "a reduction made the run")),
        number("error", "error over these frames against the converged implicit step"),
        number("velocity_error", "error of the velocities, likewise"),
        compared("error", number("expected", "error in the calibration, times the factor")),
        compared("error", number("estimate", "estimate by checks and a second run, likewise")),
        compared("error", flag("broken", "met, and the error is above the tolerance")),
        compared("error", text("level", "level of accuracy that made the run")),
        compared("error", integer("failed", "levels that were tried before")),
        compared("error", integer("checks", "frames that a more accurate level did as well")),
        MS_PER_FRAME,
        compared(
            "error",
            text("full_level", "cheapest full order within the tolerance by the calibration"),
        ),
        number("full_error", "its error over the same frames"),
        timed(number("full_ms", "time of its frame, without checks", "ms")),
        timed(number("over_full", "time of a frame over that")),
        timed(number("own_ms", "time of a frame with the scene's own iterations", "ms")),
        timed(number("over_own", "time of a frame over that")),
    ),
    reads={"runs": Every(paths.REQUESTED_TOLERANCES)},
)
def requested_tolerances(runs: list[File]) -> pd.DataFrame:
    """Rows of the ``runs`` of all scenes."""
    rows = joined(runs)
    if rows.empty:
        return rows
    met = rows.frames > 0
    return rows.assign(
        met=met,
        broken=met & ~(rows.error <= rows.tolerance),
        over_full=rows.ms_per_frame / rows.full_ms,
        over_own=rows.ms_per_frame / rows.own_ms,
    )
