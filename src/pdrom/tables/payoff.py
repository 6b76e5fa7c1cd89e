"""Table payoff: in how many scenes a reduction is accurate, and in how many of them it pays."""

import numpy as np
import pandas as pd

from pdrom.artifact.reads import TableOf
from pdrom.tables.gain_prediction import FAILED
from pdrom.tables.kit.declaration import compared, integer, number, table, timed
from pdrom.tables.kit.vocabulary import METHOD, POSITION_BASIS

_RUN = ["scene", "group", "method", "position_basis", "k", "r"]
_ERROR = "relative_error_within_horizon"


@table(
    title="Where reductions pay and where they lose to the full order",
    columns=(
        POSITION_BASIS,
        METHOD,
        compared("share", integer("scenes", "scenes (and groups) with a timed run")),
        compared(
            "share",
            integer(
                "accurate", "those with a run whose error before the horizon is at most a tenth"
            ),
        ),
        timed(integer("pays", "those among them with an accurate run faster than the full order")),
        timed(integer("loses", "those whose accurate runs are all slower")),
        timed(number("best_speedup", "median over them of the fastest accurate run's speed-up")),
        timed(number("least_speedup", "the smallest of them")),
        timed(number("most_speedup", "the largest of them")),
        timed(number("error_train", "median error of these fastest runs on the training motion")),
        timed(number("error_heldout", "the same on the held-out motion, where it was run")),
        timed(integer("heldout", "runs of which it was")),
    ),
    reads={"reruns": TableOf("reduced_reruns"), "heldout": TableOf("heldout_reruns")},
)
def payoff(reruns: pd.DataFrame, heldout: pd.DataFrame) -> pd.DataFrame:
    """One row per method, over all scenes and sizes; only what ran and was timed counts."""
    runs = reruns[reruns.speedup.notna() & reruns.max_extent.notna()]
    held = heldout[[*_RUN, _ERROR]].rename(columns={_ERROR: "error_heldout"})
    sizes = {"k": "Int64", "r": "Int64"}
    runs = runs.astype(sizes).merge(held.astype(sizes), on=_RUN, how="left")
    rows = []
    for (basis, method), own in runs.groupby(["position_basis", "method"], sort=False):
        accurate = own[own[_ERROR] <= FAILED]
        fastest = accurate.sort_values("speedup").groupby(["scene", "group"]).tail(1)
        speed = fastest.speedup.to_numpy(float)
        rows.append({
            "position_basis": basis,
            "method": method,
            "scenes": own.groupby(["scene", "group"]).ngroups,
            "accurate": len(fastest),
            "pays": int(np.sum(speed > 1.0)),
            "loses": int(np.sum(speed <= 1.0)),
            "best_speedup": fastest.speedup.median(),
            "least_speedup": fastest.speedup.min(),
            "most_speedup": fastest.speedup.max(),
            "error_train": fastest[_ERROR].median(),
            "error_heldout": fastest.error_heldout.median(),
            "heldout": int(fastest.error_heldout.notna().sum()),
        })  # fmt: skip
    return pd.DataFrame(rows)
