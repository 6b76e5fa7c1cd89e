"""Metrics of claims: functions that return a number for each selected row of a table or group."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd

from study.tables.accuracy_cost import CURVE
from study.tables.kit.results import KEYS, MEDIAN, families, trained, with_held_out

Tables = Mapping[str, pd.DataFrame]
Value = str | int | float
Where = Mapping[str, tuple[Value, ...]]
Values = Callable[[pd.DataFrame, float], pd.DataFrame | pd.Series]
VALUE = "value"
LABELS = (
    "scene", "group", "method", "position_basis", "k", "r", "split", "axis", "noisy_axes", "seed",
    "component", "implementation", "factor",
)  # fmt: skip
AXES = ("x", "y", "z")
_ERROR = "relative_error_within_horizon"
_RUN = ["scene", "group", "method"]
_RERUN = ("motion", "frames", "blowup_frame", _ERROR, *_RUN, "position_basis", "r")


def filtered(table: pd.DataFrame, where: Where) -> pd.DataFrame:
    """Rows of ``table`` whose columns have the values that ``where`` (column -> values) allows."""
    for column, allowed in where.items():
        table = table[table[column].isin(allowed)]
    return table


def reruns(table: pd.DataFrame, where: Where) -> pd.DataFrame:
    """Reduced runs of the training motion that started (sizes above the numerical rank do not).

    Runs with reduced positions are included only if ``where`` selects a position basis, because a
    method may have the same name with full and reduced positions. ``r: [full]`` selects the largest
    size tried for each scene, group and method. This includes runs that blew up before the first
    frame: otherwise a smaller size that survived would be mistaken for full rank.
    """
    table = trained(table)
    table = table if "position_basis" in where else table[table.position_basis == "full"]
    table = table[(table.frames > 0) | table.blowup_frame.notna()]
    if "full" in where.get("r", ()):
        table = table[table.r == table.groupby(_RUN).r.transform("max")]
        where = {column: allowed for column, allowed in where.items() if column != "r"}
    return filtered(table, where)


def by_axis(table: pd.DataFrame, where: Where) -> pd.DataFrame:
    """Selected rows of ``table``, once per axis x, y, z, with its error as ``relative_error``."""
    parts = [table.assign(axis=a, relative_error=table[f"relative_error_{a}"]) for a in AXES]
    return filtered(pd.concat(parts, ignore_index=True), where)


def held_out(
    choose: Callable[[pd.DataFrame, Where], pd.DataFrame], table: pd.DataFrame, where: Where
) -> pd.DataFrame:
    """Rows selected by ``choose``, with the median over held-out motions as their error.

    Runs without an error on held-out motions are left out. Times are those of the training motion.
    """
    runs = with_held_out(trained(table), table)
    return choose(runs[runs[MEDIAN].notna()].assign(**{_ERROR: runs[MEDIAN]}), where)


def decay(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Singular values relative to the largest; groups with round-off values only are left out."""
    rows = rows[rows.groupby(["scene", "group"]).above_roundoff.transform("any")]
    return rows.relative


def reconstruction(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Reconstruction error of each row; a singular interpolation has an infinite error."""
    return rows[rows.gain.notna()].relative_error.fillna(np.inf)


def axis_reconstruction(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Errors of reconstructed projections as in `reconstruction`, for each of the axes x, y and z.

    An axis whose projections are round-off at every basis size has no error and is left out.
    """
    rows = rows[rows.gain.notna()]
    curve = [rows[label] for label in (*_RUN, "split", "axis")]
    real = rows.relative_error.notna().groupby(curve).transform("any")
    return reconstruction(rows[real.astype(bool)], accuracy)


def elements_per_entry(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Number of evaluated elements divided by the number of modes r, for each row."""
    rows = rows[rows.elements_sampled.notna()]
    return rows.elements_sampled.astype(float) / rows.r


def local_ratio(name: str, rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Time of a reduced local step, or of a part of it, over that of the full compiled local step.

    The value is column ``name`` at the largest size of each scene, group, method and mesh: if the
    dense solve becomes too expensive at some size, the largest size shows it.
    """
    rows = rows.dropna(subset=[name]).sort_values("r")
    return rows.groupby(CURVE, sort=False).tail(1).sort_index()[name]


def useful_speedup(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Speed-up over the full-order run; 0 for a run whose error exceeds ``accuracy``."""
    return rows.speedup.where(rows[_ERROR] <= accuracy, 0.0).dropna()


def best_useful_speedup(rows: pd.DataFrame, accuracy: float) -> pd.DataFrame:
    """Largest value of `useful_speedup` over sizes and methods, per scene and group."""
    useful = useful_speedup(rows, accuracy).rename(VALUE)
    return useful.groupby([rows.scene, rows.group], sort=False).max().reset_index()


def error_trend(rows: pd.DataFrame, accuracy: float) -> pd.DataFrame:
    """Spearman's rank correlation of error and size, per scene, group and method.

    It is 1 if the error rises with every size, -1 if it falls. Blow-ups share the highest rank.
    Fewer than three sizes give no value; equal errors give 0.
    """
    trends = []
    for labels, run in rows.groupby(_RUN, sort=False):
        error = run[_ERROR].fillna(np.inf)
        if len(run) >= 3:
            trend = 0.0 if error.nunique() == 1 else error.rank().corr(run.r.rank())
            trends.append((*labels, trend))
    return pd.DataFrame(trends, columns=[*_RUN, VALUE])


def trend_p_value(name: str, rows: pd.DataFrame, accuracy: float) -> pd.DataFrame:
    """P-value of Page's test (1963) that errors rise with the size, over families of scenes.

    Errors are read from column ``name``, for repeated runs a median over repetitions. Treatments
    are the sizes of an experiment (scene, group, method) in ascending order; blow-ups share the
    highest rank. A block is a family, a scene with its variant ("twin"), with the mean ranks of its
    experiments, as these are dependent. Only experiments with the most common number of sizes are
    used. The result has one row, or none with fewer than two blocks or fewer than three sizes.
    """
    # imported here because it takes a second, which planning the workflow does not need
    from scipy.stats import page_trend_test, rankdata

    runs = [run for _, run in rows.sort_values("r").groupby(_RUN, sort=False)]
    lengths = [len(run) for run in runs]
    common = max(set(lengths), key=lambda n: (lengths.count(n), n), default=0)
    ranks: dict[str, list[np.ndarray]] = {}
    for run in (run for run in runs if len(run) == common):
        ranked = run[name].rank(na_option="bottom").to_numpy(float)
        ranks.setdefault(families(run.scene).iloc[0], []).append(ranked)
    if len(ranks) < 2 or common < 3:
        return pd.DataFrame(columns=[VALUE])
    blocks = [rankdata(np.mean(own, axis=0)) for own in ranks.values()]
    return pd.DataFrame({VALUE: [float(page_trend_test(blocks, ranked=True).pvalue)]})


def noise_error(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Error of runs whose basis is round-off; infinite if a run ends early or cannot start."""
    return rows[rows.r <= rows["rank"]].relative_error.fillna(np.inf)


def position_basis_ratio(rows: pd.DataFrame, accuracy: float) -> pd.DataFrame:
    """Error with POD position basis over error with skinning basis of equal size k, per scene.

    Pairs in which both errors exceed ``accuracy`` are left out, as their ratio is meaningless.
    """
    kinds = [rows[rows.position_basis == kind] for kind in ("pod", "skinning")]
    pod, skinning = (rows.set_index(["scene", "k"])[_ERROR] for rows in kinds)
    both = pd.DataFrame({"pod": pod, "skinning": skinning}).dropna()
    both = both[both.min(axis=1) <= accuracy]
    return both.assign(**{VALUE: both["pod"] / both["skinning"]})[[VALUE]].reset_index()


def over_the_rest(share: np.ndarray) -> np.ndarray:
    """Ratio share / (1 - share) of a part's time to the remaining time."""
    with np.errstate(divide="ignore"):
        return np.divide(share, np.subtract(1.0, share))


@dataclass(frozen=True)
class Metric:
    """Metric of a test, computed from columns of one table.

    of : function of the selected rows and ``accuracy``; returns values of some of these rows, or a
        table of columns such as scene and group with a `VALUE` in each row
    choose : function of the table and ``where`` (column -> allowed values) that selects the rows
    labels : columns allowed in ``where`` in addition to the columns of the table
    ratio : function that converts a value to a ratio of two times, for metrics based on times
    """

    of: Values
    table: str
    columns: tuple[str, ...]
    choose: Callable[[pd.DataFrame, Where], pd.DataFrame] = filtered
    labels: tuple[str, ...] = ()
    ratio: Callable[[np.ndarray], np.ndarray] = np.asarray

    def values(self, tables: Tables, where: Where, accuracy: float) -> pd.DataFrame:
        """Columns such as scene, and a `VALUE`, for each row of the table that ``where`` allows.

        Parameters
        ----------
        accuracy : largest error of a run that counts as accurate
        """
        rows = self.choose(tables[self.table], where)
        found = self.of(rows, accuracy)
        if isinstance(found, pd.DataFrame):
            return found
        labels = [label for label in LABELS if label in rows]
        return rows.loc[found.index, labels].assign(**{VALUE: found})


def _of_reruns(of: Values, *more: str) -> Metric:
    return Metric(of, "reduced_reruns", (*_RERUN, *more), reruns)


_RECONSTRUCTION = "reconstruction_error"
METRICS = {
    # share of the local step in the time of a frame
    "local_share": Metric(
        lambda rows, _: rows.local_share, "local_share", ("local_share",), ratio=over_the_rest
    ),
    # error before the horizon; infinite for a run that blew up before it
    "rerun_error": _of_reruns(lambda rows, _: rows[_ERROR].fillna(np.inf)),
    "useful_speedup": _of_reruns(useful_speedup, "speedup"),
    "best_useful_speedup": _of_reruns(best_useful_speedup, "speedup"),
    "error_trend": _of_reruns(error_trend),
    "trend_p_value": _of_reruns(partial(trend_p_value, _ERROR)),
    "repeated_trend_p_value": Metric(
        partial(trend_p_value, "error_median"),
        "repetitions",
        (*_RUN, "r", "varied", "error_median"),
    ),
    "singular_value_decay": Metric(
        decay, "singular_values", ("scene", "group", "above_roundoff", "relative")
    ),
    "reconstruction_error": Metric(reconstruction, _RECONSTRUCTION, ("gain", "relative_error")),
    "axis_reconstruction_error": Metric(
        axis_reconstruction,
        _RECONSTRUCTION,
        (*_RUN, "split", "gain", *(f"relative_error_{axis}" for axis in AXES)),
        by_axis,
        labels=("axis",),
    ),
    "noise_error": Metric(noise_error, "noise", ("r", "rank", "relative_error")),
    "elements_per_entry": Metric(elements_per_entry, _RECONSTRUCTION, ("elements_sampled", "r")),
    **{
        f"{part}_time_ratio": Metric(partial(local_ratio, name), "breakeven", (*CURVE, "r", name))
        for part, name in (("local", "ratio"), ("solve", "solve_ratio"), ("lift", "lift_ratio"))
    },
    "position_basis_ratio": Metric(
        position_basis_ratio,
        "reduced_reruns",
        ("motion", "scene", "k", "position_basis", _ERROR),
        lambda table, where: filtered(trained(table), where),
    ),
}
METRICS |= {
    f"heldout_{name}": replace(
        metric,
        choose=partial(held_out, metric.choose),
        columns=tuple(
            dict.fromkeys((*metric.columns, *_RERUN, "horizon_frame", "playback_error", *KEYS))
        ),
    )
    for name, metric in METRICS.items()
    if metric.table == "reduced_reruns" and name != "trend_p_value"
}
