"""Table guard: what the guard of a run costs, and what falling back buys."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, TableOf
from study.tables.kit.declaration import compared, integer, number, table, text, timed
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import (
    BLOWUP_FRAME,
    ENERGY_RATIO,
    FINITE,
    FRAMES,
    GROUP,
    GUARD_COUNT,
    GUARD_ESTIMATE,
    GUARD_FRAME,
    GUARD_REASON,
    METHOD,
    MS_PER_FRAME,
    RELATIVE_ERROR,
    SCENE,
    R,
)


@table(
    title="Guard at run time: what it costs and what falling back buys",
    columns=(
        SCENE,
        GROUP,
        METHOD,
        R,
        text("action", "of the guard: none, report, fall-back"),
        text("alarm", "what the guard listens to: trained-range, estimate"),
        compared("exact", number("threshold", "largest estimate that is no alarm")),
        FRAMES,
        FINITE,
        BLOWUP_FRAME,
        RELATIVE_ERROR,
        ENERGY_RATIO,
        GUARD_FRAME,
        GUARD_REASON,
        GUARD_COUNT,
        GUARD_ESTIMATE,
        compared("error", integer("fallback_frames", "frames computed with full projections")),
        compared("error", number("fallback_share", "their share of the frames that ran")),
        MS_PER_FRAME,
        timed(number("relative_cost", "time of a frame over that of the full-order run")),
    ),
    reads={"parts": Every(paths.GUARD), "frame_times": TableOf("frame_times")},
)
def guard(parts: list[File], frame_times: pd.DataFrame) -> pd.DataFrame:
    """Rows of all cases, ``parts``, each after its full-order run; times as in ``frame_times``."""
    rows = joined(parts)
    if rows.empty:
        return rows
    scenes = frame_times.set_index("scene").ms_per_frame
    one = rows.scene.map(scenes) * rows.relative_cost
    return rows.assign(ms_per_frame=one.fillna(rows.ms_per_frame))
