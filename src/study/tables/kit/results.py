"""Helpers for tables: read rows, scale times, choose runs, take medians over test trajectories.

A job that times reduced runs of a scene, or runs without an effect, also times its full-order run,
because machine speed differs between jobs. All times of a job are multiplied by one factor: time of
the full-order run in table frame_times / its time in the job. Ratios of a job's times stay equal.
"""

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from pdrom.reduction.timing import PHASES
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import CONVERGED, Column, integer, number, text

RESAMPLES, SEED = 2000, 1
KEYS = ["scene", "group", "method", "position_basis", "k", "r"]  # columns that identify a run
TRAIN = "train"
ERROR, DEFORMATION = "relative_error_within_horizon", "deformation_error"
MEDIAN, LOW, HIGH, COUNT = "error_heldout", "error_heldout_low", "error_heldout_high", "motions"
SHAPE = "deformation_heldout"
COLUMNS = (
    number(MEDIAN, "median position error on test trajectories; inf: a run blew up"),
    number(LOW, "least position error on test trajectories"),
    number(HIGH, "largest position error on test trajectories"),
    number(SHAPE, "median deformation error on test trajectories; inf: a run blew up"),
    integer(COUNT, "test trajectories, 30 % or more from training, with frames before the horizon"),
    number("playback_error", "median error if the training trajectory is replayed instead"),
)
FAR = 0.3  # test trajectories whose relative distance to the training is less are left out
EXPERIMENT = ["scene", "group"]
MEASURES = POSITION, BOTH = "position", "both"
OWN_ERRORS = "reference_error", "reference_deformation_error"
THIRD = 1.0 / 3.0  # largest allowed error of a reference, over the limit for errors of runs
ORTHOGONAL = "pod"  # method that evaluates all elements and projects onto the basis orthogonally
FAILED = 0.1  # a run whose error over the compared frames exceeds this counts as failed
TWIN = "_twin"  # end of the name of a scene's short variant; scene and variant are a family


def joined(files: Iterable[File]) -> pd.DataFrame:
    """Rows of the tables in ``files``, in order; a frame without columns if there are no rows."""
    parts = [part for part in (read_table(file.path) for file in files) if len(part)]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


class Rows(Every):
    """Rows of all files of a kind: the function gets `joined` files. See `Table.__call__`."""

    def content(self, paths: Any) -> Any:
        return joined(super().content(paths))


def with_whole_sizes(rows: pd.DataFrame) -> pd.DataFrame:
    """Return ``rows`` with sizes k and r as nullable integers, by which tables can be joined."""
    return rows.astype({size: "Int64" for size in ("k", "r") if size in rows})


DAY = text("recorded", "day on which config/extended.yaml recorded the row; empty: computed here")


def recordable(columns: Sequence[Column]) -> list[str]:
    """Names of ``columns`` to copy from rows of another machine: all except measured times."""
    return [c.name for c in columns if not (c.timed and c.unit in ("ms", "s"))]


def with_recorded(rows: pd.DataFrame, record: list[Path], known: Sequence[Column]) -> pd.DataFrame:
    """Append rows of ``record`` that ``rows`` lack, with the `recordable` columns of ``known``."""
    if not record:
        return rows.assign(recorded=None)
    others = read_table(record[0], result=False).reindex(columns=recordable(known))
    if rows.empty:
        return others.reindex(columns=[column.name for column in known])
    keys = [name for name in ("scene", "factor", "stiffness") if name in rows]
    others = others[~among(others, rows, keys)]
    return pd.concat([rows.assign(recorded=None), others], ignore_index=True)


def in_one_time(
    table: pd.DataFrame, own: pd.Series, times: pd.DataFrame, columns: Collection[str]
) -> pd.DataFrame:
    """Scale ``columns`` (times) so that a scene's full-order frame takes as long as in ``times``.

    own : scene -> time of its full-order frame in the job that measured ``table``, ms
    times : table frame_times; the times of scenes that it lacks are not scaled
    """
    one = times.set_index("scene").ms_per_frame.reindex(own.index)
    factor = table.scene.map((one / own).fillna(1.0)).fillna(1.0)
    return table.assign(**{name: table[name] * factor for name in columns})


def timings_in_one_time(timings: pd.DataFrame, times: pd.DataFrame) -> pd.DataFrame:
    """Rows of ``timings``, scaled by `in_one_time` to the full-order frame times of ``times``."""
    own = timings[timings.method.isna() & (timings.implementation == "compiled")]
    own = own.set_index("scene").ms_per_frame
    return in_one_time(timings, own, times, [name for name in PHASES if name in timings])


def median_interval(values: Sequence[float] | np.ndarray) -> tuple[float, float, float]:
    """Median, and the 2.5 % and 97.5 % quantiles of medians of resampled values (bootstrap).

    For a single value, or equal values, both quantiles are that value.
    """
    # imported here, as the import takes a second and planning the workflow does not need SciPy
    from scipy.stats import bootstrap

    x = np.asarray(values, float)
    if len(x) < 2 or np.ptp(x) == 0.0:
        return (float(np.median(x)),) * 3
    found = bootstrap(
        (x,), np.median, n_resamples=RESAMPLES, confidence_level=0.95, method="percentile",
        rng=np.random.default_rng(SEED),
    ).confidence_interval  # fmt: skip
    return float(np.median(x)), float(found.low), float(found.high)


def in_words(median: float, low: float, high: float) -> str:
    """Text with the ``median`` and the interval from ``low`` to ``high``, rounded."""
    return f"{_rounded(median)} ({_rounded(low)} to {_rounded(high)})"


def _rounded(value: float) -> str:
    """Text of ``value`` rounded to two significant digits, without an exponent."""
    place = 1 - int(np.floor(np.log10(abs(value))))
    return f"{round(value, place):.{max(0, place)}f}"


def among(rows: pd.DataFrame, others: pd.DataFrame, keys: Sequence[str]) -> np.ndarray:
    """Boolean array: True for ``rows`` whose cells in columns ``keys`` occur in ``others``."""
    own, known = (pd.MultiIndex.from_frame(e[[*keys]].astype(object)) for e in (rows, others))
    return own.isin(known)


def trained(reruns: pd.DataFrame) -> pd.DataFrame:
    """Rows of the table reduced_reruns (``reruns``) for the training trajectory."""
    return reruns[reruns.motion == TRAIN]


def against_converged(reruns: pd.DataFrame) -> pd.DataFrame:
    """Return ``reruns`` with the errors against the converged runs."""
    errors = {ERROR: reruns.error_converged, DEFORMATION: reruns.deformation_converged}
    return reruns.assign(**errors, reference=CONVERGED)


def measured(rows: pd.DataFrame, measure: str) -> pd.DataFrame:
    """Return ``rows`` with the position error or, for ``measure`` "both", the larger error.

    A run has no deformation error if its reference moves rigidly; its position error then counts.
    """
    if measure == POSITION:
        return rows
    position, shape = rows[ERROR].astype(float), rows[DEFORMATION].astype(float)
    return rows.assign(**{ERROR: np.fmax(position, shape).where(position.notna())})


def judged_by(rows: pd.DataFrame, measure: str, limit: float) -> pd.DataFrame:
    """Rows whose references are accurate enough: their errors are at most a third of ``limit``."""
    own = OWN_ERRORS[: MEASURES.index(measure) + 1]
    errors = rows[[*own]].astype(float)
    known = errors.iloc[:, 0].notna() & ~(errors > THIRD * limit).any(axis=1)
    return measured(rows[known], measure)


def over_motions(reruns: pd.DataFrame, keys: Sequence[str] = KEYS) -> pd.DataFrame:
    """Median, least and largest error of each run on test trajectories, and their number.

    A run that blew up before the horizon has an infinite error. Left out are sizes above the rank,
    trajectories with horizon 0, and those that the training trajectory replaces up to `FAR`.
    """
    ran = (reruns.frames > 0) | reruns.blowup_frame.notna()
    tests = (reruns.horizon_frame > 0) & (reruns.playback_error > FAR)
    rows = with_whole_sizes(reruns[(reruns.motion != TRAIN) & ran & tests])
    error, shape = rows[ERROR].astype(float), rows[DEFORMATION].astype(float)
    rows = rows.assign(error=error.fillna(np.inf), shape=shape.mask(error.isna(), np.inf))
    ends = {MEDIAN: "median", LOW: "min", HIGH: "max", COUNT: "count"}
    found = {name: ("error", end) for name, end in ends.items()}
    found |= {SHAPE: ("shape", "median"), "playback_error": ("playback_error", "median")}
    return rows.groupby(list(keys), sort=False, dropna=False).agg(**found).reset_index()


def with_held_out(runs: pd.DataFrame, reruns: pd.DataFrame) -> pd.DataFrame:
    """Join ``runs`` with their errors on test trajectories (`over_motions`)."""
    own = with_whole_sizes(runs).drop(columns="playback_error", errors="ignore")
    return own.merge(over_motions(reruns), on=KEYS, how="left")


def judged_runs(reruns: pd.DataFrame, reconstruction: pd.DataFrame) -> pd.DataFrame:
    """Training runs of sampled methods with unreduced positions and a sufficient basis.

    A basis suffices if the run with orthogonal projection at the largest size up to r (a centred
    basis may have one mode less) has an error of at most `FAILED`. The result has the columns of
    ``reruns``, and gain, error (before the horizon; inf if the run blew up), failed.
    """
    runs = trained(reruns)
    runs = runs[(runs.position_basis == "full") & runs.max_extent.notna()]
    error = runs[ERROR].mask(runs[ERROR].isna() & runs.blowup_frame.notna(), np.inf)
    runs = runs.assign(error=error, failed=error > FAILED)
    keys = [*EXPERIMENT, "method", "r"]
    train = reconstruction[reconstruction.split == "train"]
    runs = runs.merge(train[[*keys, "gain"]], on=keys, how="left").astype({"r": "int64"})
    orthogonal = runs.loc[runs.method == ORTHOGONAL, [*EXPERIMENT, "r", "error"]]
    orthogonal = orthogonal.rename(columns={"error": "orthogonal_error"}).sort_values("r")
    order = runs.reset_index().sort_values("r", kind="stable")
    runs = pd.merge_asof(order, orthogonal, on="r", by=EXPERIMENT).sort_values("index")
    fine = (runs.orthogonal_error <= FAILED) & (runs.method != ORTHOGONAL) & runs.error.notna()
    return runs[fine & runs.gain.notna()].reset_index(drop=True)
