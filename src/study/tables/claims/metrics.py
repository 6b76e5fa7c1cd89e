"""Metrics of claims: functions that return a number for each selected row (or group of rows)."""

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd

from study.tables.accuracy_cost import CURVE
from study.tables.kit.results import ERROR, EXPERIMENT, MEDIAN, TWIN, trained, with_held_out

Tables = Mapping[str, pd.DataFrame]
Value = str | int | float
Where = Mapping[str, tuple[Value, ...]]
Values = Callable[[pd.DataFrame, float], pd.DataFrame | pd.Series]
VALUE = "value"
LABELS = (
    "scene", "group", "method", "position_basis", "k", "r", "split", "axis", "noisy_axes", "seed",
    "component", "implementation", "factor",
)  # fmt: skip
_RUN = [*EXPERIMENT, "method"]


def filtered(table: pd.DataFrame, where: Where) -> pd.DataFrame:
    """Rows of ``table`` whose cells are allowed by ``where`` (column -> allowed values)."""
    for column, allowed in where.items():
        table = table[table[column].isin(allowed)]
    return table


def reruns(table: pd.DataFrame, where: Where) -> pd.DataFrame:
    """Reduced runs on the training trajectory that ``where`` selects and that could be started.

    Runs with reduced positions are included only if ``where`` selects a position basis, because
    methods have the same names there. ``r: [full]`` selects the largest size tried for each scene,
    group and method, even if that run blew up, as no smaller size is the full rank.
    """
    table = trained(table)
    table = table if "position_basis" in where else table[table.position_basis == "full"]
    table = table[(table.frames > 0) | table.blowup_frame.notna()]
    if "full" in where.get("r", ()):
        table = table[table.r == table.groupby(_RUN).r.transform("max")]
        where = {column: allowed for column, allowed in where.items() if column != "r"}
    return filtered(table, where)


def by_axis(table: pd.DataFrame, where: Where) -> pd.DataFrame:
    """Rows that ``where`` selects, once per axis x, y, z with this axis's ``relative_error``."""
    parts = [table.assign(axis=a, relative_error=table[f"relative_error_{a}"]) for a in "xyz"]
    return filtered(pd.concat(parts, ignore_index=True), where)


def held_out(
    choose: Callable[[pd.DataFrame, Where], pd.DataFrame], table: pd.DataFrame, where: Where
) -> pd.DataFrame:
    """Rows of ``table`` that ``choose`` selects, with the median of their test errors."""
    runs = with_held_out(trained(table), table)
    return choose(runs[runs[MEDIAN].notna()].assign(**{ERROR: runs[MEDIAN]}), where)


def decay(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Singular value / largest one of the group; groups of mere rounding errors are left out."""
    return rows.relative[rows.groupby(EXPERIMENT).above_roundoff.transform("any")]


def reconstruction(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Reconstruction error per row; inf if the interpolation is singular."""
    return rows[rows.gain.notna()].relative_error.fillna(np.inf)


def axis_reconstruction(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Reconstruction errors of each coordinate, without axes that have only rounding errors."""
    rows = rows[rows.gain.notna()]
    curve = [rows[label] for label in (*_RUN, "split", "axis")]
    real = rows.relative_error.notna().groupby(curve).transform("any")
    return reconstruction(rows[real.astype(bool)], accuracy)


def elements_per_entry(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Number of evaluated elements divided by r, the number of modes."""
    return rows.elements_sampled.dropna().astype(float) / rows.r[rows.elements_sampled.notna()]


def local_ratio(name: str, rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Column ``name`` (time of a reduced local step over that of the full one) at the largest r.

    There the dense solve for the coefficients is the most expensive.
    """
    rows = rows.dropna(subset=[name]).sort_values("r")
    return rows.groupby(CURVE, sort=False).tail(1).sort_index()[name]


def useful_speedup(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Speed-up over the full-order run; 0 for a run whose error exceeds ``accuracy``."""
    return rows.speedup.where(rows[ERROR] <= accuracy, 0.0).dropna()


def best_useful_speedup(rows: pd.DataFrame, accuracy: float) -> pd.DataFrame:
    """Largest speed-up with an error up to ``accuracy`` (else 0) for each scene and group."""
    useful = rows.assign(**{VALUE: useful_speedup(rows, accuracy)}).dropna(subset=VALUE)
    return useful.groupby(EXPERIMENT, sort=False, as_index=False)[VALUE].max()


def error_trend(rows: pd.DataFrame, accuracy: float) -> pd.DataFrame:
    """Spearman's rank correlation of error and size r (1: rises), for each scene, group and method.

    Runs that blew up share the highest rank. Fewer than three sizes give no value.
    """
    trends = []
    for labels, run in rows.groupby(_RUN, sort=False):
        error = run[ERROR].fillna(np.inf)
        if len(run) >= 3:
            trend = 0.0 if error.nunique() == 1 else error.rank().corr(run.r.rank())
            trends.append((*labels, trend))
    return pd.DataFrame(trends, columns=[*_RUN, VALUE])


def trend_p_value(name: str, rows: pd.DataFrame, accuracy: float) -> pd.DataFrame:
    """P-value of Page's test (1963) that the error in column ``name`` rises with the size r.

    Treatments are the sizes of an experiment (scene, group, method); runs that blew up share the
    highest rank. A scene and its short variant are one block, with mean ranks. Only experiments
    with the most common number of sizes are used. No row for less than 2 blocks or 3 sizes.
    """
    # Imported here because the import takes a second and planning the workflow does not need SciPy.
    from scipy.stats import page_trend_test, rankdata

    ranks: dict[int, dict[str, list[pd.Series]]] = defaultdict(lambda: defaultdict(list))
    for (scene, *_), run in rows.sort_values("r").groupby(_RUN, sort=False):
        ranks[len(run)][scene.removesuffix(TWIN)].append(run[name].rank(na_option="bottom"))
    common = max(ranks, key=lambda n: (sum(map(len, ranks[n].values())), n), default=0)
    if len(ranks[common]) < 2 or common < 3:
        return pd.DataFrame(columns=[VALUE])
    blocks = [rankdata(np.mean(own, axis=0)) for own in ranks[common].values()]
    return pd.DataFrame({VALUE: [float(page_trend_test(blocks, ranked=True).pvalue)]})


def noise_error(rows: pd.DataFrame, accuracy: float) -> pd.Series:
    """Error of runs whose snapshots are mere rounding errors; inf if a run blew up or never ran."""
    return rows[rows.r <= rows["rank"]].relative_error.fillna(np.inf)


def position_basis_ratio(rows: pd.DataFrame, accuracy: float) -> pd.DataFrame:
    """Error with POD over that with skinning, by scene and k, if one is at most ``accuracy``."""
    kinds = [rows[rows.position_basis == kind] for kind in ("pod", "skinning")]
    pod, skinning = (rows.set_index(["scene", "k"])[ERROR] for rows in kinds)
    both = pd.DataFrame({"pod": pod, "skinning": skinning}).dropna()
    both = both[both.min(axis=1) <= accuracy]
    return both["pod"].div(both["skinning"]).rename(VALUE).reset_index()


def over_the_rest(share: np.ndarray) -> np.ndarray:
    """Time of a part of a frame divided by that of the rest, from the ``share`` of the part."""
    with np.errstate(divide="ignore"):
        return np.divide(share, np.subtract(1.0, share))


@dataclass(frozen=True)
class Metric:
    """Metric that a test of a claim compares with a threshold, computed from one table.

    of : function of the selected rows and ``accuracy`` (largest error of an accurate run); returns
        values of some of these rows, or a table with columns `VALUE`, scene, group ...
    choose : function of the table and ``where`` (column -> allowed values) that selects the rows
    labels : columns that ``where`` may name although the table lacks them: ``choose`` adds them
    timed : whether values are measured times; ``ratio``: function that makes ratios of two times
    """

    of: Values
    table: str
    choose: Callable[[pd.DataFrame, Where], pd.DataFrame] = filtered
    labels: tuple[str, ...] = ()
    timed: bool = False
    ratio: Callable[[np.ndarray], np.ndarray] = np.asarray

    def values(self, tables: Tables, where: Where, accuracy: float) -> pd.DataFrame:
        """Table of the metric (column `VALUE`), scene, group ... of rows that ``where`` allows."""
        rows = self.choose(tables[self.table], where)
        found = self.of(rows, accuracy)
        if isinstance(found, pd.DataFrame):
            return found
        labels = [label for label in LABELS if label in rows]
        return rows.loc[found.index, labels].assign(**{VALUE: found})


_RERUNS, _RECONSTRUCTION = "reduced_reruns", "reconstruction_error"
METRICS = {
    "local_share": Metric(
        lambda rows, _: rows.local_share, "local_share", timed=True, ratio=over_the_rest
    ),
    "rerun_error": Metric(lambda rows, _: rows[ERROR].fillna(np.inf), _RERUNS, reruns),
    "useful_speedup": Metric(useful_speedup, _RERUNS, reruns, timed=True),
    "best_useful_speedup": Metric(best_useful_speedup, _RERUNS, reruns, timed=True),
    "error_trend": Metric(error_trend, _RERUNS, reruns),
    "trend_p_value": Metric(partial(trend_p_value, ERROR), _RERUNS, reruns),
    "repeated_trend_p_value": Metric(partial(trend_p_value, "error_median"), "repetitions"),
    "singular_value_decay": Metric(decay, "singular_values"),
    "reconstruction_error": Metric(reconstruction, _RECONSTRUCTION),
    "axis_reconstruction_error": Metric(
        axis_reconstruction, _RECONSTRUCTION, by_axis, labels=("axis",)
    ),
    "noise_error": Metric(noise_error, "noise"),
    "elements_per_entry": Metric(elements_per_entry, _RECONSTRUCTION),
    **{
        f"{part}_time_ratio": Metric(partial(local_ratio, name), "breakeven", timed=True)
        for part, name in (("local", "ratio"), ("solve", "solve_ratio"), ("lift", "lift_ratio"))
    },
    "position_basis_ratio": Metric(
        position_basis_ratio, _RERUNS, lambda table, where: filtered(trained(table), where)
    ),
}
METRICS |= {
    f"heldout_{name}": replace(metric, choose=partial(held_out, metric.choose))
    for name, metric in METRICS.items()
    if metric.table == _RERUNS and name != "trend_p_value"
}
