"""Table accuracy_cost: each method and size as a point (error, time), and the best."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from pdrom.store import read_table
from pdrom.tables.columns import conform


def accuracy_cost(
    reruns: pd.DataFrame, timings: Iterable[str], iterations: dict[str, int]
) -> pd.DataFrame:
    """Points of the reruns whose error within the horizon and time exist, and the full-order runs.

    A compiled full-order run is its own reference: method and position basis "full", error zero.

    Parameters
    ----------
    reruns : the table reduced_reruns
    timings : timing tables of the scenes
    iterations : scene -> local/global iterations K per frame
    """
    times = pd.concat([read_table(path) for path in timings], ignore_index=True)
    full = times[times.method.isna() & (times.implementation == "compiled")].copy()
    full = full.assign(method="full", position_basis="full", relative_error_within_horizon=0.0)
    points = reruns.dropna(subset=["relative_error_within_horizon", "ms_per_frame"])
    points = pd.concat([full, points], ignore_index=True)
    points["k"], points["r"] = points["k"].astype("Int64"), points["r"].astype("Int64")
    points["iterations"] = points.scene.map(iterations)
    points["pareto"] = False
    for _, rows in points.groupby("scene", sort=False):
        error = rows.relative_error_within_horizon.to_numpy(float)
        points.loc[rows.index, "pareto"] = pareto(error, rows.ms_per_frame.to_numpy(float))
    order = points.scene.map({scene: i for i, scene in enumerate(reruns.scene.unique())})
    return conform(points.iloc[np.argsort(order, kind="stable")], "accuracy_cost")


def pareto(error: Sequence[float], cost: Sequence[float]) -> list[bool]:
    """Whether no other point is at least as good in both and better in one."""
    return [
        not any((e <= a) & (c <= b) & ((e < a) | (c < b)) for e, c in zip(error, cost, strict=True))
        for a, b in zip(error, cost, strict=True)
    ]
