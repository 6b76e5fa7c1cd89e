"""What claims are decided by: a number for each chosen row of a table, with the row's labels."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import page_trend_test

from pdrom.core.errors import ConfigurationError
from pdrom.tables.break_even import CURVE

Tables = Mapping[str, pd.DataFrame]
Value = str | int | float
VALUE = "value"
LABELS = (
    "scene", "group", "method", "position_basis", "k", "r", "split", "axis", "noisy_axes", "seed",
    "component", "implementation", "factor", "threads",
)  # fmt: skip
AXES = ("x", "y", "z")
_PLACE = ("scene", "group", "method", "position_basis")


def filtered(table: pd.DataFrame, where: Mapping[str, tuple[Value, ...]]) -> pd.DataFrame:
    for column, allowed in where.items():
        if column not in table.columns:
            raise ConfigurationError(
                f"claims: no column '{column}' (allowed: {', '.join(table.columns)})"
            )
        table = table[table[column].isin(allowed)]
    return table


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
    """Reruns; only those whose positions are not reduced, unless ``where`` says otherwise.

    A method may have the same name with full and with reduced positions.
    """
    table = tables["reduced_reruns"]
    return table if "position_basis" in where else table[table.position_basis == "full"]


def _tried(rows: pd.DataFrame) -> pd.DataFrame:
    """Reruns that started: not the marked ones, whose size exceeds the numerical rank."""
    return rows[(rows.frames > 0) | rows.blowup_frame.notna()]


def _labelled(rows: pd.DataFrame, values: pd.Series) -> pd.DataFrame:
    """Labels of ``rows``, as far as they have them, and a value for each."""
    return rows[[label for label in LABELS if label in rows]].assign(**{VALUE: values})


def _local_share(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    rows = filtered(tables["local_share"], where)
    return _labelled(rows, rows.local_share)


def _rerun_error(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Error within the horizon; a run that blew up before its horizon counts as infinite."""
    table, where = _full_rank_only(_reruns(tables, where), where)
    rows = _tried(filtered(table, where))
    return _labelled(rows, rows.relative_error_within_horizon.fillna(np.inf))


def _useful_speedup(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Speed-up over the full-order run; 0 for a run that is not accurate."""
    table, where = _full_rank_only(_reruns(tables, where), where)
    rows = _tried(filtered(table, where))
    accurate = rows.relative_error_within_horizon <= accuracy
    return _labelled(rows, rows.speedup.where(accurate, 0.0)).dropna(subset=[VALUE])


def _best_useful_speedup(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """The largest useful speed-up over sizes and methods, per scene and group."""
    runs = _useful_speedup(tables, where, accuracy)
    return runs.groupby(["scene", "group"], sort=False)[VALUE].max().reset_index()


def _error_trend(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
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


def _trend_p_value(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """P-value of Page's test (1963) that errors rise with the sizes, over all experiments together.

    An experiment (scene, group, method) is a block, the places of its sizes in ascending order are
    the treatments; blow-ups share the highest rank. Blocks with the most common number of sizes
    count; one value, or none with fewer than two blocks of three sizes.
    """
    rows = _tried(filtered(_reruns(tables, where), where)).sort_values("r")
    blocks = [
        run.relative_error_within_horizon.rank(na_option="bottom").to_numpy(float)
        for _, run in rows.groupby(["scene", "group", "method"], sort=False)
    ]
    lengths = [len(block) for block in blocks]
    common = max(set(lengths), key=lambda n: (lengths.count(n), n), default=0)
    ranks = [block for block in blocks if len(block) == common]
    if len(ranks) < 2 or common < 3:
        return pd.DataFrame(columns=[VALUE])
    return pd.DataFrame({VALUE: [float(page_trend_test(ranks, ranked=True).pvalue)]})


def _decay(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    rows = filtered(tables["singular_values"], where)
    rows = rows[rows.groupby(["scene", "group"]).above_roundoff.transform("any")]
    return _labelled(rows, rows.relative)


def _reconstruction(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Reconstruction error; a singular interpolation counts as infinite."""
    rows = filtered(tables["reconstruction_error"], where)
    rows = rows[rows.gain.notna()]
    return _labelled(rows, rows.relative_error.fillna(np.inf))


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
        parts.append(_labelled(one, error[real].fillna(np.inf)).assign(axis=axis))
    return pd.concat(parts, ignore_index=True)


def _noise_error(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Error of runs on bases of round-off; infinite where a run ends early or cannot start."""
    rows = filtered(tables["noise"], where)
    rows = rows[rows.r <= rows["rank"]]
    return _labelled(rows, rows.relative_error.fillna(np.inf))


def _elements_per_entry(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    rows = filtered(tables["reconstruction_error"], where)
    rows = rows[rows.elements_sampled.notna()]
    return _labelled(rows, rows.elements_sampled.astype(float) / rows.r)


def _local_ratio(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Time of the reduced local step over that of the full compiled one, at the largest size.

    One value per scene, group, method, mesh and number of threads: whether the dense solve costs
    more from some size on shows at the largest size that the basis has.
    """
    rows = filtered(tables["breakeven"], where).dropna(subset=["ratio"]).sort_values("r")
    largest = rows.groupby(CURVE, sort=False).tail(1).sort_index()
    return _labelled(largest, largest.ratio)


def _position_basis_ratio(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Error of the snapshot basis over that of the skinning basis at equal k, per scene.

    Only where at least one of the two is accurate: the better of two failures says nothing.
    """
    rows = filtered(tables["reduced_reruns"], where)
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
    """What a test compares: values from some columns of one table.

    values : from tables, ``where`` and ``accuracy`` to a row of labels and a `VALUE` for each
    labels : columns that rows may be chosen by, beside those of the table
    """

    values: Callable[[Tables, dict, float], pd.DataFrame]
    table: str
    columns: tuple[str, ...]
    labels: tuple[str, ...] = ()


_RERUN = ("frames", "blowup_frame", "relative_error_within_horizon", *_PLACE, "r")
METRICS = {
    "local_share": Metric(_local_share, "local_share", ("local_share",)),
    "rerun_error": Metric(_rerun_error, "reduced_reruns", _RERUN),
    "useful_speedup": Metric(_useful_speedup, "reduced_reruns", (*_RERUN, "speedup")),
    "best_useful_speedup": Metric(_best_useful_speedup, "reduced_reruns", (*_RERUN, "speedup")),
    "error_trend": Metric(_error_trend, "reduced_reruns", _RERUN),
    "trend_p_value": Metric(_trend_p_value, "reduced_reruns", _RERUN),
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
    "noise_error": Metric(_noise_error, "noise", ("r", "rank", "relative_error")),
    "elements_per_entry": Metric(
        _elements_per_entry, "reconstruction_error", ("elements_sampled", "r")
    ),
    "local_time_ratio": Metric(_local_ratio, "breakeven", (*CURVE, "r", "ratio")),
    "position_basis_ratio": Metric(
        _position_basis_ratio,
        "reduced_reruns",
        ("scene", "k", "position_basis", "relative_error_within_horizon"),
    ),
}
