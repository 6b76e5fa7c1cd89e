"""Table budget: the smallest error that a given time per frame buys in each scene."""

from collections.abc import Sequence

import pandas as pd

from pdrom.tables.accuracy_cost import reference_of
from pdrom.tables.columns import COLUMNS, conform


def budget(points: pd.DataFrame, budgets: Sequence[float]) -> pd.DataFrame:
    """One row per scene, budget and reference; the cheapest of equally accurate settings.

    Where nothing fits the budget the row names no method.

    Parameters
    ----------
    points : the table accuracy_cost
    budgets : milliseconds per frame
    """
    points = points.assign(reference=reference_of(points))
    rows = []
    for (scene, reference), part in points.groupby(["scene", "reference"], sort=False):
        part = part.sort_values(["relative_error_within_horizon", "ms_per_frame"], kind="stable")
        for limit in budgets:
            fits = part[part.ms_per_frame <= limit].head(1)
            best = fits.iloc[0].to_dict() if len(fits) else {}
            rows.append(best | {"scene": scene, "reference": reference, "budget_ms": limit})
    table = pd.DataFrame(rows, columns=list(COLUMNS["budget"]))
    return conform(table.astype(dict.fromkeys(("k", "r", "iterations"), "Int64")), "budget")
