"""Metrics of claims: a number for each chosen row of a table, with the row's labels."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd

from study.tables.break_even import CURVE
from study.tables.claims.rows import AXES, Tables, filtered, labelled
from study.tables.claims.run_metrics import (
    best_useful_speedup,
    error_trend,
    held_out,
    noise_error,
    position_basis_ratio,
    repeated_trend_p_value,
    rerun_error,
    trend_p_value,
    useful_speedup,
)
from study.tables.kit.held_out import KEYS

_PLACE = ("scene", "group", "method", "position_basis")


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


@dataclass(frozen=True)
class Metric:
    """Metric of a test: values from some columns of one table.

    values : from tables, ``where`` and ``accuracy`` to a row of labels and a `VALUE` for each
    labels : columns that rows may be chosen by, in addition to those of the table
    ratio : a value as the ratio of two times, where it is made of times in another way
    """

    values: Callable[[Tables, dict, float], pd.DataFrame]
    table: str
    columns: tuple[str, ...]
    labels: tuple[str, ...] = ()
    ratio: Callable[[np.ndarray], np.ndarray] = np.asarray


def _over_the_rest(share: np.ndarray) -> np.ndarray:
    """A share of a time as the ratio of this part to the rest."""
    with np.errstate(divide="ignore"):
        return np.divide(share, np.subtract(1.0, share))


_RERUN = ("motion", "frames", "blowup_frame", "relative_error_within_horizon", *_PLACE, "r")
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
_HELD_OUT = (
    "rerun_error", "useful_speedup", "best_useful_speedup", "error_trend", "position_basis_ratio",
)  # fmt: skip
METRICS |= {
    f"heldout_{name}": replace(
        METRICS[name],
        values=held_out(METRICS[name].values),
        columns=tuple(dict.fromkeys((*METRICS[name].columns, *_RERUN, "horizon_frame", *KEYS))),
    )
    for name in _HELD_OUT
}
READ = sorted({metric.table for metric in METRICS.values()})
