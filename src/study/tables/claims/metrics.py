"""Metrics of claims: a number for each chosen row of a table, with the row's labels.

A metric gets ``tables`` by name, values that ``where`` allows in columns of theirs, and the largest
error of an accurate run, ``accuracy``.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd

from pdrom.core.errors import ConfigurationError
from study.tables.kit.reruns import KEYS, MEDIAN, families, trained, with_held_out
from study.tables.payoff import CURVE

Tables = Mapping[str, pd.DataFrame]
Value = str | int | float
VALUE = "value"
LABELS = (
    "scene", "group", "method", "position_basis", "k", "r", "split", "axis", "noisy_axes", "seed",
    "component", "implementation", "factor",
)  # fmt: skip
AXES = ("x", "y", "z")
Values = Callable[[Tables, dict, float], pd.DataFrame]
_PLACE = ("scene", "group", "method", "position_basis")
_RERUN = ("motion", "frames", "blowup_frame", "relative_error_within_horizon", *_PLACE, "r")
_HELD_OUT = (
    "rerun_error", "useful_speedup", "best_useful_speedup", "error_trend", "position_basis_ratio",
)  # fmt: skip


def filtered(table: pd.DataFrame, where: Mapping[str, tuple[Value, ...]]) -> pd.DataFrame:
    """Rows of ``table`` whose columns have the values that ``where`` allows.

    Raises
    ------
    ConfigurationError
        The table has no such column.
    """
    for column, allowed in where.items():
        if column not in table.columns:
            raise ConfigurationError(
                f"claims: no column '{column}' (allowed: {', '.join(table.columns)})"
            )
        table = table[table[column].isin(allowed)]
    return table


def labelled(rows: pd.DataFrame, values: pd.Series) -> pd.DataFrame:
    """Labels of ``rows``, as far as they have them, and one of ``values`` for each."""
    return rows[[label for label in LABELS if label in rows]].assign(**{VALUE: values})


def _local_share(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    rows = filtered(tables["local_share"], where)
    return labelled(rows, rows.local_share)


def _decay(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    rows = filtered(tables["singular_values"], where)
    rows = rows[rows.groupby(["scene", "group"]).above_roundoff.transform("any")]
    return labelled(rows, rows.relative)


def _reconstruction(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Reconstruction error; a singular interpolation counts as infinite."""
    rows = filtered(tables["reconstruction_error"], where)
    rows = rows[rows.gain.notna()]
    return labelled(rows, rows.relative_error.fillna(np.inf))


def _axis_reconstruction(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Reconstruction error of each axis; infinite where the interpolation is singular.

    An axis whose projections are round-off at every size has no error.
    """
    chosen = {key: value for key, value in where.items() if key != "axis"}
    rows = filtered(tables["reconstruction_error"], chosen)
    rows = rows[rows.gain.notna()]
    parts = []
    for axis in where.get("axis", AXES):
        error = rows[f"relative_error_{axis}"]
        curve = [rows[label] for label in ("scene", "group", "method", "split") if label in rows]
        real = error.notna().groupby(curve).transform("any") if len(rows) else error.notna()
        one = rows[real]
        parts.append(labelled(one, error[real].fillna(np.inf)).assign(axis=axis))
    return pd.concat(parts, ignore_index=True)


def _elements_per_entry(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    rows = filtered(tables["reconstruction_error"], where)
    rows = rows[rows.elements_sampled.notna()]
    return labelled(rows, rows.elements_sampled.astype(float) / rows.r)


def _local_ratio(column: str, tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Time of a reduced local step (or part) over the full compiled one's, at the largest size.

    One value per scene, group, method and mesh: whether the dense solve costs
    more from some size on shows at the largest size that the basis has.
    """
    rows = filtered(tables["breakeven"], where).dropna(subset=[column]).sort_values("r")
    largest = rows.groupby(CURVE, sort=False).tail(1).sort_index()
    return labelled(largest, largest[column])


def _full_rank_only(table: pd.DataFrame, where: dict) -> tuple[pd.DataFrame, dict]:
    """Handles ``r: [full]``: the largest size tried for each scene, group and method.

    A run that blew up before its first frame was tried, too: leaving it out would put a smaller
    size, which survived, in the place of full rank.
    """
    if "r" not in where or "full" not in where["r"]:
        return table, where
    ran = _tried(table)
    largest = ran.groupby(["scene", "group", "method"]).r.transform("max")
    return ran[ran.r == largest], {k: v for k, v in where.items() if k != "r"}


def _reruns(tables: Tables, where: dict) -> pd.DataFrame:
    """Reruns of the training motion; with reduced positions only if ``where`` selects them.

    A method may have the same name with full and with reduced positions.
    """
    table = trained(tables["reduced_reruns"])
    return table if "position_basis" in where else table[table.position_basis == "full"]


def _tried(rows: pd.DataFrame) -> pd.DataFrame:
    """Reruns that started: not the marked ones, whose size exceeds the numerical rank."""
    return rows[(rows.frames > 0) | rows.blowup_frame.notna()]


def held_out(values: Values) -> Values:
    """``values`` of the same runs with their median error over held-out motions.

    Runs without a held-out motion that can be judged are left out. Times are the training run's.
    """

    def of_held_out(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
        reruns = tables["reduced_reruns"]
        runs = with_held_out(trained(reruns), reruns)
        runs = runs[runs[MEDIAN].notna()].assign(relative_error_within_horizon=runs[MEDIAN])
        return values({**tables, "reduced_reruns": runs}, where, accuracy)

    return of_held_out


def rerun_error(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Error within the horizon; a run that blew up before its horizon counts as infinite."""
    table, where = _full_rank_only(_reruns(tables, where), where)
    rows = _tried(filtered(table, where))
    return labelled(rows, rows.relative_error_within_horizon.fillna(np.inf))


def useful_speedup(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Speed-up over the full-order run; 0 for a run that is not accurate."""
    table, where = _full_rank_only(_reruns(tables, where), where)
    rows = _tried(filtered(table, where))
    accurate = rows.relative_error_within_horizon <= accuracy
    return labelled(rows, rows.speedup.where(accurate, 0.0)).dropna(subset=[VALUE])


def best_useful_speedup(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """The largest useful speed-up over sizes and methods, per scene and group."""
    runs = useful_speedup(tables, where, accuracy)
    return runs.groupby(["scene", "group"], sort=False)[VALUE].max().reset_index()


def error_trend(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Spearman's rank correlation of error and size, per scene, group and method.

    1 where the error rises with every size, -1 where it falls; blow-ups share the highest rank.
    Fewer than three sizes have no trend; errors that are all equal have the trend 0.
    """
    rows = _tried(filtered(_reruns(tables, where), where))
    trends = []
    for labels, run in rows.groupby(["scene", "group", "method"], sort=False):
        error = run.relative_error_within_horizon.fillna(np.inf)
        if len(run) >= 3:
            trend = 0.0 if error.nunique() == 1 else error.rank().corr(run.r.rank())
            trends.append((*labels, trend))
    return pd.DataFrame(trends, columns=["scene", "group", "method", VALUE])


def trend_p_value(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """P-value of Page's test (1963) that errors rise with the sizes, over families of scenes.

    The places of the sizes of an experiment (scene, group, method) in ascending order are the
    treatments, and blow-ups share the highest rank of its errors. A scene, its twin and the methods
    on both are no independent observations: the mean ranks of a family's experiments are one block.
    Experiments with the most common number of sizes count; one value, or none with fewer than two
    blocks of three sizes.
    """
    rows = _tried(filtered(_reruns(tables, where), where))
    return _page(rows, "relative_error_within_horizon")


def repeated_trend_p_value(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """p-value of the trend of the medians over repetitions, as one run may rise by chance."""
    return _page(filtered(tables["repetitions"], where), "error_median")


def _page(rows: pd.DataFrame, error: str) -> pd.DataFrame:
    """One p-value, or no row with fewer than two blocks of three sizes."""
    runs = [
        run for _, run in rows.sort_values("r").groupby(["scene", "group", "method"], sort=False)
    ]
    lengths = [len(run) for run in runs]
    common = max(set(lengths), key=lambda n: (lengths.count(n), n), default=0)
    # imported here: at the top it would cost a second of every plan
    from scipy.stats import page_trend_test, rankdata

    ranks: dict[str, list[np.ndarray]] = {}
    for run in (run for run in runs if len(run) == common):
        ranked = run[error].rank(na_option="bottom").to_numpy(float)
        ranks.setdefault(families(run.scene).iloc[0], []).append(ranked)
    if len(ranks) < 2 or common < 3:
        return pd.DataFrame(columns=[VALUE])
    blocks = [rankdata(np.mean(own, axis=0)) for own in ranks.values()]
    return pd.DataFrame({VALUE: [float(page_trend_test(blocks, ranked=True).pvalue)]})


def noise_error(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Error of runs on bases of round-off; infinite where a run ends early or cannot start."""
    rows = filtered(tables["noise"], where)
    rows = rows[rows.r <= rows["rank"]]
    return labelled(rows, rows.relative_error.fillna(np.inf))


def position_basis_ratio(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Error of the snapshot basis over that of the skinning basis at equal k, per scene.

    Only where at least one of the two is accurate: the better of two failures says nothing.
    """
    rows = filtered(trained(tables["reduced_reruns"]), where)
    keys = ["scene", "k"]
    errors = {
        kind: rows[rows.position_basis == kind].set_index(keys).relative_error_within_horizon
        for kind in ("pod", "skinning")
    }
    both = pd.DataFrame(errors).dropna()
    both = both[both.min(axis=1) <= accuracy]
    return both.assign(**{VALUE: both["pod"] / both["skinning"]})[[VALUE]].reset_index()


@dataclass(frozen=True)
class Metric:
    """Metric of a test: values from some columns of one table.

    values : from tables, ``where`` and ``accuracy`` to a row of labels and a `VALUE` for each
    labels : columns that rows may be chosen by, in addition to those of the table
    ratio : a value as the ratio of two times, where it is made of times in another way
    """

    values: Values
    table: str
    columns: tuple[str, ...]
    labels: tuple[str, ...] = ()
    ratio: Callable[[np.ndarray], np.ndarray] = np.asarray


def _over_the_rest(share: np.ndarray) -> np.ndarray:
    """A share of a time as the ratio of this part to the rest."""
    with np.errstate(divide="ignore"):
        return np.divide(share, np.subtract(1.0, share))


METRICS = {
    "local_share": Metric(_local_share, "local_share", ("local_share",), ratio=_over_the_rest),
    "rerun_error": Metric(rerun_error, "reduced_reruns", _RERUN),
    "useful_speedup": Metric(useful_speedup, "reduced_reruns", (*_RERUN, "speedup")),
    "best_useful_speedup": Metric(best_useful_speedup, "reduced_reruns", (*_RERUN, "speedup")),
    "error_trend": Metric(error_trend, "reduced_reruns", _RERUN),
    "trend_p_value": Metric(trend_p_value, "reduced_reruns", _RERUN),
    "repeated_trend_p_value": Metric(
        repeated_trend_p_value,
        "repetitions",
        ("scene", "group", "method", "r", "varied", "error_median"),
    ),
    "singular_value_decay": Metric(
        _decay, "singular_values", ("scene", "group", "above_roundoff", "relative")
    ),
    "reconstruction_error": Metric(
        _reconstruction, "reconstruction_error", ("gain", "relative_error")
    ),
    "axis_reconstruction_error": Metric(
        _axis_reconstruction,
        "reconstruction_error",
        ("scene", "group", "method", "split", "gain", *(f"relative_error_{a}" for a in AXES)),
        ("axis",),
    ),
    "noise_error": Metric(noise_error, "noise", ("r", "rank", "relative_error")),
    "elements_per_entry": Metric(
        _elements_per_entry, "reconstruction_error", ("elements_sampled", "r")
    ),
    **{
        metric: Metric(partial(_local_ratio, column), "breakeven", (*CURVE, "r", column))
        for metric, column in (
            ("local_time_ratio", "ratio"),
            ("solve_time_ratio", "solve_ratio"),
            ("lift_time_ratio", "lift_ratio"),
        )
    },
    "position_basis_ratio": Metric(
        position_basis_ratio,
        "reduced_reruns",
        ("motion", "scene", "k", "position_basis", "relative_error_within_horizon"),
    ),
}
METRICS |= {
    f"heldout_{name}": replace(
        METRICS[name],
        values=held_out(METRICS[name].values),
        columns=tuple(dict.fromkeys((*METRICS[name].columns, *_RERUN, "horizon_frame", *KEYS))),
    )
    for name in _HELD_OUT
}
