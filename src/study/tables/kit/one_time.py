"""Times of jobs, as multiples of the one time that each full-order run has (table frame_times).

A job times its own full-order run beside its variants, but the machine runs at another speed in
another job, and so one run would have several times. Ratios within a job do not mind: the job's
times are multiplied by the one time of the scene over the job's own time of its full-order run.
"""

from collections.abc import Collection, Sequence

import pandas as pd

from study.artifact.paths import File
from study.tables.kit.parts import joined

PHASES = ("ms_per_frame", "inertia_ms", "local_ms", "assembly_ms", "lift_ms", "global_ms")


def in_one_time(
    table: pd.DataFrame, own: pd.Series, times: pd.DataFrame, columns: Collection[str]
) -> pd.DataFrame:
    """``table`` with its ``columns`` of times brought to the scenes' one time.

    Scenes that were not timed in several processes keep the times of their job.

    Parameters
    ----------
    own : scene -> time of a full-order frame in the job, ms
    times : table frame_times
    """
    one = times.set_index("scene").ms_per_frame.reindex(own.index)
    factor = table.scene.map((one / own).fillna(1.0)).fillna(1.0)
    return table.assign(**{name: table[name] * factor for name in columns})


def timings_in_one_time(timings: Sequence[File], times: pd.DataFrame) -> pd.DataFrame:
    """Rows of the ``timings`` of all scenes in ``times``, see `in_one_time`."""
    rows = joined(timings)
    if rows.empty:
        return rows
    own = rows[rows.method.isna() & (rows.implementation == "compiled")]
    own = own.set_index("scene").ms_per_frame
    return in_one_time(rows, own, times, columns=[name for name in PHASES if name in rows])
