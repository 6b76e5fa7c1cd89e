"""Table effects_cost: what each effect of a scene costs."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, TableOf
from study.tables.kit.declaration import integer, number, table, text, timed
from study.tables.kit.one_time import in_one_time
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import MS_PER_FRAME, SCENE

TIMES = ("ms_per_frame",)


@table(
    title="Cost of each effect in a full-order frame",
    columns=(
        SCENE,
        text(
            "effect",
            "name of the effect; right-hand side, global solve and the rest have rows, too",
        ),
        integer("elements", "elements of a group, vertices of another effect"),
        MS_PER_FRAME,
        timed(number("share", "of the frame; those of a scene add up to one")),
    ),
    reads={"parts": Every(paths.EFFECTS), "frame_times": TableOf("frame_times")},
)
def effects_cost(parts: list[File], frame_times: pd.DataFrame) -> pd.DataFrame:
    """Tables of the scenes, ``parts``, one after the other, in the one time of ``frame_times``."""
    rows = joined(parts)
    if rows.empty:
        return rows
    return in_one_time(rows, rows.groupby("scene").ms_per_frame.sum(), frame_times, columns=TIMES)
