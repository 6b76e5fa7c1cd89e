"""Table accuracy_cost: each method and size as a point (error, time), Pareto-optimal ones marked."""

import pandas as pd

from pdrom.tables.columns import conform


def accuracy_cost(reruns: pd.DataFrame, iterations: dict[str, int]) -> pd.DataFrame:
    """Points of the reduced reruns whose error within the horizon and time exist.

    Parameters
    ----------
    reruns : the table reduced_reruns
    iterations : scene -> local/global iterations K per frame
    """
    points = reruns.dropna(subset=["relative_error_within_horizon", "ms_per_frame"]).copy()
    points["iterations"] = points.scene.map(iterations)
    points["pareto"] = False
    for _, rows in points.groupby("scene", sort=False):
        points.loc[rows.index, "pareto"] = pareto(
            rows.relative_error_within_horizon.to_numpy(float), rows.ms_per_frame.to_numpy(float)
        )
    return conform(points, "accuracy_cost")


def pareto(error: "pd.Series", cost: "pd.Series") -> list[bool]:
    """Whether no other point is at least as good in both and better in one."""
    return [
        not any((e <= a) & (c <= b) & ((e < a) | (c < b)) for e, c in zip(error, cost, strict=True))
        for a, b in zip(error, cost, strict=True)
    ]
