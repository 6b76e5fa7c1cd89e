"""Table model_choice: the model that the estimate chooses for a tolerance of the user."""

from collections.abc import Sequence
from typing import Any

import pandas as pd

from pdrom.model.held_out import FIRST
from study.artifact.reads import Setting, TableOf
from study.tables.kit.declaration import compared, flag, number, table
from study.tables.kit.held_out import AS_ERRORS, HIGH, LOW, MEDIAN, with_held_out
from study.tables.kit.reruns import KEYS
from study.tables.kit.vocabulary import (
    ERROR_WITHIN,
    GROUP,
    METHOD,
    MS_PER_FRAME,
    POSITION_BASIS,
    SCENE,
    K,
    R,
)

_WHOLE = {"k": "Int64", "r": "Int64"}
_CHOSEN = [
    "group", "method", "position_basis", "k", "r", "estimate", "relative_error_within_horizon",
    "ms_per_frame", MEDIAN, LOW, HIGH,
]  # fmt: skip


@table(
    title="Models chosen for a tolerance by their estimates",
    columns=(
        SCENE,
        compared("exact", number("tolerance", "error that the user allows")),
        compared("error", flag("found", "an estimate times the safety factor is within it")),
        GROUP,
        METHOD,
        POSITION_BASIS,
        K,
        R,
        compared("error", number("estimate", "of the chosen model on the held-out motion")),
        ERROR_WITHIN,
        compared("error", flag("met", "its true error is within the tolerance")),
        MS_PER_FRAME,
        *AS_ERRORS,
        compared("error", flag("met_heldout", "the median of these errors is within it")),
    ),
    reads={
        "estimates": TableOf("estimates"),
        "reruns": TableOf("reduced_reruns"),
        "heldout": TableOf("heldout_reruns"),
        "tolerances": Setting("companion.tolerances"),
        "safety": Setting("companion.safety"),
    },
)
def model_choice(
    estimates: pd.DataFrame,
    reruns: pd.DataFrame,
    heldout: pd.DataFrame,
    tolerances: Sequence[float],
    safety: float,
) -> pd.DataFrame:
    """The cheapest model of each scene whose estimate on the held-out motion meets a tolerance.

    It meets one that it does not exceed when multiplied by ``safety``.
    Nothing of that motion's full order goes into the choice. Cheapest is the one that evaluates
    the fewest elements, then has the fewest modes: times differ from run to run. It is scored on
    the motion that it was chosen for, and on the other held-out ones.
    """
    chosen_on = estimates[(estimates.split == FIRST) & (estimates.position_basis != "full")]
    times = reruns[[*KEYS, "ms_per_frame"]].astype(_WHOLE).drop_duplicates(KEYS)
    runs = chosen_on.astype(_WHOLE).merge(times, on=KEYS, how="left")
    runs = with_held_out(runs, heldout[heldout.motion != FIRST])
    rows: list[dict[str, Any]] = []
    for scene, models in runs.groupby("scene", sort=False):
        for tolerance in tolerances:
            good = models[safety * models.estimate <= tolerance]
            good = good.sort_values(["r", "k"], kind="stable")
            row: dict[str, Any] = {"scene": scene, "tolerance": tolerance, "found": len(good) > 0}
            if len(good):
                chosen = good.iloc[0]
                error = chosen.relative_error_within_horizon
                row |= chosen[_CHOSEN].to_dict()
                row["met"] = bool(error <= tolerance)
                row["met_heldout"] = bool(chosen[MEDIAN] <= tolerance)
            rows.append(row)
    return pd.DataFrame(rows)
