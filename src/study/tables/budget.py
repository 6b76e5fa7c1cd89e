"""Table budget: the smallest error that a given time per frame buys in each scene."""

from collections.abc import Sequence

import pandas as pd

from study.artifact.reads import Setting, TableOf
from study.tables.accuracy_cost import CONVERGED, OWN, reference_of
from study.tables.kit.declaration import compared, integer, number, table, text, timed
from study.tables.kit.vocabulary import (
    ERROR_WITHIN,
    METHOD,
    MS_PER_FRAME,
    POSITION_BASIS,
    SCENE,
    K,
    R,
)


# A time decides which point of accuracy_cost a row names, hence all that the row says of it.
@table(
    title="What a frame's budget of time buys",
    columns=(
        SCENE,
        compared("exact", number("budget_ms", "time that a frame may take", "ms")),
        text("reference", f"what the error is taken against: {CONVERGED} or {OWN}"),
        timed(METHOD),
        timed(POSITION_BASIS),
        timed(K),
        timed(R),
        timed(integer("iterations", "local/global iterations of a frame")),
        timed(ERROR_WITHIN),
        MS_PER_FRAME,
    ),
    reads={"points": TableOf("accuracy_cost"), "budgets": Setting("budgets")},
)
def budget(points: pd.DataFrame, budgets: Sequence[float]) -> pd.DataFrame:
    """One row per scene, budget and reference; the cheapest of equally accurate settings.

    Where nothing fits the budget the row names no method.

    Parameters
    ----------
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
    return pd.DataFrame(rows, columns=budget.column_names)
