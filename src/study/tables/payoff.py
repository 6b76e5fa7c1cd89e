"""Table payoff: in how many scenes a reduction is accurate, and in how many of them it pays."""

import numpy as np
import pandas as pd

from study.artifact.reads import TableOf
from study.tables.kit.declaration import compared, integer, number, table, timed
from study.tables.kit.reruns import FAILED, trained, with_held_out
from study.tables.kit.vocabulary import METHOD, POSITION_BASIS

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
        timed(
            number(
                "error_heldout",
                "median of their errors on held-out motions, of each the median over its motions",
            )
        ),
        timed(integer("heldout", "runs that had a held-out motion")),
        timed(number("error_heldout_low", "median of the least error of each over its motions")),
        timed(number("error_heldout_high", "median of the largest")),
        compared(
            "share",
            integer(
                "accurate_heldout",
                "scenes (and groups) whose most accurate size on the training motion has at most a "
                "tenth held out",
            ),
        ),
        timed(integer("pays_heldout", "those that pay whose run has at most a tenth held out")),
    ),
    reads={"reruns": TableOf("reduced_reruns")},
)
def payoff(reruns: pd.DataFrame) -> pd.DataFrame:
    """One row per method, over all scenes and sizes; only what ran and was timed counts.

    Sizes are chosen on the training motion of ``reruns`` and scored on the others, see
    `with_held_out`.
    """
    runs = trained(reruns)
    runs = with_held_out(runs[runs.speedup.notna() & runs.max_extent.notna()], reruns)
    rows = []
    for (basis, method), own in runs.groupby(["position_basis", "method"], sort=False):
        accurate = own[own[_ERROR] <= FAILED]
        fastest = accurate.sort_values("speedup").groupby(["scene", "group"]).tail(1)
        speed = fastest.speedup.to_numpy(float)
        best = own.sort_values(_ERROR, kind="stable").groupby(["scene", "group"]).head(1)
        seen = best[best.error_heldout.notna()]
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
            "error_heldout_low": fastest.error_heldout_low.median(),
            "error_heldout_high": fastest.error_heldout_high.median(),
            "accurate_heldout": int((seen.error_heldout <= FAILED).sum()),
            "pays_heldout": int(np.sum((speed > 1.0) & (fastest.error_heldout <= FAILED))),
        })  # fmt: skip
    return pd.DataFrame(rows)
