"""Functions that join the tables written by experiments and make their times comparable.

Each job times the full-order run of its scene together with the variants, but machine speed differs
between jobs. To give the full-order run one time, all times of a job are multiplied by the scene's
time in the table frame_times over the job's own time of its full-order run. Ratios within a job
do not change.
"""

from collections.abc import Collection, Iterable, Sequence

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from study.artifact.paths import File
from study.experiments.kit.measurement import PHASES

RESAMPLES, SEED, LEVEL = 2000, 1, 0.95


def joined(files: Iterable[File]) -> pd.DataFrame:
    """Rows of the tables in ``files``, in order; an empty frame without columns if none exist."""
    parts = [part for part in (read_table(file.path) for file in files) if len(part)]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def in_one_time(
    table: pd.DataFrame, own: pd.Series, times: pd.DataFrame, columns: Collection[str]
) -> pd.DataFrame:
    """``table`` with its time ``columns`` scaled to the times of the table frame_times.

    Scenes that the table frame_times lacks retain the times measured in their job.

    Parameters
    ----------
    own : scene -> time of a full-order frame in the job, ms
    times : table frame_times
    """
    one = times.set_index("scene").ms_per_frame.reindex(own.index)
    factor = table.scene.map((one / own).fillna(1.0)).fillna(1.0)
    return table.assign(**{name: table[name] * factor for name in columns})


def timings_in_one_time(timings: Sequence[File], times: pd.DataFrame) -> pd.DataFrame:
    """Rows of the files ``timings``, scaled to the table ``times`` by `in_one_time`."""
    rows = joined(timings)
    if rows.empty:
        return rows
    own = rows[rows.method.isna() & (rows.implementation == "compiled")]
    own = own.set_index("scene").ms_per_frame
    return in_one_time(rows, own, times, columns=[name for name in PHASES if name in rows])


def median_interval(values: Sequence[float] | np.ndarray) -> tuple[float, float, float]:
    """Median, and the 2.5 % and 97.5 % quantiles of medians of resampled values (bootstrap).

    For a single value, or equal values, both quantiles are that value.
    """
    # imported here because it takes a second, which planning the workflow does not need
    from scipy.stats import bootstrap

    x = np.asarray(values, float)
    if len(x) < 2 or np.ptp(x) == 0.0:
        return (float(np.median(x)),) * 3
    found = bootstrap(
        (x,), np.median, n_resamples=RESAMPLES, confidence_level=LEVEL, method="percentile",
        rng=np.random.default_rng(SEED),
    ).confidence_interval  # fmt: skip
    return float(np.median(x)), float(found.low), float(found.high)


def in_words(median: float, low: float, high: float) -> str:
    """Text with the ``median`` and the interval from ``low`` to ``high``."""
    return f"{_rounded(median)} ({_rounded(low)} to {_rounded(high)})"


def _rounded(value: float) -> str:
    """Text of ``value`` rounded to two significant digits, without an exponent."""
    place = 1 - int(np.floor(np.log10(abs(value))))
    return f"{round(value, place):.{max(0, place)}f}"
