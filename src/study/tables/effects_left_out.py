"""Table effects_left_out: what leaving effects out saves."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, TableOf
from study.tables.kit.declaration import integer, number, table, text, timed
from study.tables.kit.one_time import in_one_time
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import MS_PER_FRAME, SCENE

NOTHING = "nothing"
TIMES = ("ms_per_frame", "saved_ms", "own_ms")


@table(
    title="Time of scenes without some of their effects",
    columns=(
        SCENE,
        text("left_out", "effects that the scene is built without"),
        integer("groups", "constraint groups that are left"),
        integer("elements", "elements of what is left out, as in the table effects_cost"),
        MS_PER_FRAME,
        timed(number("saved_ms", "time of the whole scene less that of the row", "ms")),
        timed(number("own_ms", "time of what is left out, inside the whole scene", "ms")),
    ),
    reads={"parts": Every(paths.LEFT_OUT), "frame_times": TableOf("frame_times")},
)
def effects_left_out(parts: list[File], frame_times: pd.DataFrame) -> pd.DataFrame:
    """Scenes with several groups, ``parts``: as they are and without some of their effects.

    Times are brought to those of the table ``frame_times``.
    """
    rows = joined(parts)
    if rows.empty:
        return rows
    own = rows[rows.left_out == NOTHING].set_index("scene").ms_per_frame
    return in_one_time(rows, own, frame_times, columns=TIMES)
