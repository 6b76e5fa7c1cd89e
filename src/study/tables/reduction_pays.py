"""Table reduction_pays: from what mesh size on a reduction is the cheapest way to an error."""

import numpy as np
import pandas as pd

from study.artifact.reads import TableOf
from study.tables.alternatives import STIFFNESS
from study.tables.kit.declaration import integer, number, table, timed
from study.tables.kit.vocabulary import SCENE
from study.tables.winners import LIMIT, REFERENCE

CASE = ["scene", "stiffness", "reference", "limit"]


@table(
    title="From what mesh size on a reduction pays",
    columns=(
        SCENE,
        STIFFNESS,
        REFERENCE,
        LIMIT,
        integer("smallest", "vertices of the smallest mesh compared"),
        integer("largest", "vertices of the largest one"),
        timed(integer("from_plain", "vertices from which on it beats projective dynamics itself")),
        timed(integer("from_best", "vertices from which on it beats the best full-order method")),
        timed(number("breaks_even", "vertices where it would be as fast as that, interpolated")),
        integer("motions", "held-out motions"),
        timed(integer("reached", "motions in which it reaches the error on the largest mesh")),
        timed(
            number(
                "speedup", "over the best full-order method there, median of motions that reach it"
            )
        ),
        timed(number("speedup_low", "least 2.5 % quantile of a motion")),
        timed(number("speedup_high", "largest 97.5 % quantile of a motion")),
        timed(integer("from_best_own", "from_best, trained on frames of the scene's iterations")),
        timed(number("speedup_own", "the same of their speed-up")),
    ),
    reads={"rows": TableOf("winners")},
)
def reduction_pays(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per scene, stiffness, reference and error; empty where it never reaches or pays.

    It pays on a mesh where it does in every motion.
    """
    found = []
    for labels, case in rows.groupby(CASE, sort=False):
        # NaN where one motion is not reached
        every = case.assign(
            plain=case.plain_ms / case.reduced_ms, own=case.ms_per_frame / case.own_ms
        )
        worst = every.groupby("vertices")[["plain", "reduced_speedup", "own"]].agg(
            lambda speedups: speedups.min(skipna=False)
        )
        sizes = worst.index.to_numpy(float)
        plain, best, own = worst.to_numpy(float).T
        last = every[every.vertices == sizes[-1]]
        found.append(
            {
                **dict(zip(CASE, labels, strict=True)),
                "smallest": int(sizes[0]),
                "largest": int(sizes[-1]),
                "from_plain": _pays_from(sizes, plain),
                "from_best": _pays_from(sizes, best),
                "breaks_even": _breaks_even(sizes, best),
                "motions": len(last),
                "reached": int(last.reduced_speedup.notna().sum()),
                "speedup": last.reduced_speedup.median(),
                "speedup_low": last.reduced_speedup_low.min(),
                "speedup_high": last.reduced_speedup_high.max(),
                "from_best_own": _pays_from(sizes, own),
                "speedup_own": last.own.median(),
            }
        )
    made = pd.DataFrame(found, columns=reduction_pays.column_names)
    return made.astype(dict.fromkeys(["from_plain", "from_best", "from_best_own"], "Int64"))


def _first(speedups: np.ndarray) -> int:
    """Number of the first mesh from which on all speed-ups exceed one; n if there is none."""
    losing = np.flatnonzero(~(speedups > 1.0))
    return int(losing[-1]) + 1 if len(losing) else 0


def _pays_from(sizes: np.ndarray, speedups: np.ndarray) -> int | None:
    first = _first(speedups)
    return int(sizes[first]) if first < len(sizes) else None


def _breaks_even(sizes: np.ndarray, speedups: np.ndarray) -> float | None:
    """Size where the line through the logarithms passes one, between two meshes that reach it."""
    first = _first(speedups)
    if not 0 < first < len(sizes) or np.isnan(speedups[first - 1]):
        return None
    before, after = np.log(speedups[first - 1 : first + 1])
    return float(np.exp(np.interp(0.0, [before, after], np.log(sizes[first - 1 : first + 1]))))
