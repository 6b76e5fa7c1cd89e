"""Table winners: the cheapest method for an error, and from what size on a reduction is cheaper."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting, TableOf
from study.experiments.alternatives.settings import REDUCTIONS
from study.tables.alternatives import ITERATIONS, MOTION, STIFFNESS, SUBSTEPS, beside
from study.tables.kit.declaration import compared, integer, number, table, text, timed
from study.tables.kit.intervals import median_interval
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import METHOD, MS_PER_FRAME, SCENE, VERTICES

REFERENCES = ("implicit", "continuous")
CASE = ["scene", "vertices", "stiffness", "motion"]
PAYS = (
    "from_plain", "from_best", "motions", "reached", "speedup", "speedup_low", "speedup_high",
)  # fmt: skip
SPEEDUP = ("reduced_speedup", "reduced_speedup_low", "reduced_speedup_high")
CURVE = ["scene", "stiffness", "reference", "limit"]
PLAIN = "projective"
KNOWN = 3.0  # a motion decides about an error only if it is known this many times better

REFERENCE = text("reference", "what the error is taken against: implicit or continuous")
LIMIT = compared("exact", number("limit", "error that is allowed"))


# A time decides which row of alternatives wins, hence all that is said of it.
@table(
    title="Who reaches an error in the shortest time",
    columns=(
        SCENE,
        VERTICES,
        STIFFNESS,
        MOTION,
        REFERENCE,
        LIMIT,
        timed(METHOD),
        timed(SUBSTEPS),
        timed(ITERATIONS),
        timed(number("error", "error that it has")),
        MS_PER_FRAME,
        timed(text("second", "the next best of the other full-order methods")),
        timed(number("second_ms", "time of a frame of the second", "ms")),
        timed(number("margin", "time of the second over that of the first")),
        timed(number("plain_ms", "time of one-step projective dynamics, if it reaches it", "ms")),
        timed(number("reduced_error", "smallest error of the reduction")),
        timed(number("reduced_ms", "time of a frame of the reduction, if it reaches it", "ms")),
        timed(
            number("reduced_speedup", "time of the first over that of the reduction in a process")
        ),
        timed(number("reduced_speedup_low", "2.5 % quantile of this median (bootstrap)")),
        timed(number("reduced_speedup_high", "97.5 % quantile")),
        timed(text("reduced_method", "the reduction that is the fastest to reach it")),
        timed(text("reduced_trained_on", "the frames that it is trained on")),
        timed(integer("reduced_iterations", "its iterations of a substep")),
        timed(integer("from_plain", "vertices from which on a reduction beats plain iterations")),
        timed(integer("from_best", "vertices from which on it beats the best full-order method")),
        integer("motions", "held-out motions"),
        timed(integer("reached", "motions in which it reaches the error on the largest mesh")),
        timed(
            number(
                "speedup", "over the best full-order method there, median of motions that reach it"
            )
        ),
        timed(number("speedup_low", "least 2.5 % quantile of a motion")),
        timed(number("speedup_high", "largest 97.5 % quantile of a motion")),
    ),
    reads={
        "rows": TableOf("alternatives"),
        "times": Every(paths.ALTERNATIVE_TIMES),
        "limits": Setting("alternatives.errors"),
    },
)
def winners(rows: pd.DataFrame, times: list[File], limits: Sequence[float]) -> pd.DataFrame:
    """One row per scene, mesh, stiffness, motion, reference and error; no method where none does.

    Errors that are too small to be told from that of the motion in continuous time have no row.
    Among the methods of the first motion are those that no other motion has.
    """
    found = []
    if len(rows):
        rows, processes = beside(rows, joined(times))
    for labels, case in rows.groupby(CASE, sort=False):
        named = dict(zip(CASE, labels, strict=True))
        for reference in REFERENCES:
            timed_rows = case[case.ms_per_frame.notna()]
            known = timed_rows.assign(error=timed_rows[f"error_{reference}"])
            for limit in limits:
                if reference == "continuous" and not KNOWN * case.reference_error.max() <= limit:
                    continue
                row = {**named, "reference": reference, "limit": limit}
                found.append({**row, **_best(known, limit, processes)})
    made = pd.DataFrame(found, columns=winners.column_names).drop(columns=list(PAYS))
    pays = [{**dict(zip(CURVE, key, strict=True)), **_pays(own)}
            for key, own in made.groupby(CURVE, sort=False)]  # fmt: skip
    return made.merge(pd.DataFrame(pays, columns=[*CURVE, *PAYS]), on=CURVE, how="left")


def _best(rows: pd.DataFrame, limit: float, processes: list[int]) -> dict[str, object]:
    """First, second and reduced one to reach ``limit``; what nobody does is left out.

    A speed-up is a ratio within each of the ``processes`` that timed both.
    """
    reaching = rows[rows.error <= limit].sort_values("ms_per_frame", kind="stable")
    inside = reaching.method.isin(REDUCTIONS)
    full, reduced = reaching[~inside], reaching[inside]
    made: dict[str, object] = {"reduced_error": rows.error[rows.method.isin(REDUCTIONS)].min()}
    plain = reaching[(reaching.method == PLAIN) & (reaching.substeps == 1)]
    if len(plain):
        made["plain_ms"] = plain.ms_per_frame.iloc[0]
    if len(reduced):
        first = reduced.iloc[0]
        made |= {f"reduced_{key}": first[key] for key in ("method", "trained_on", "iterations")}
        made["reduced_ms"] = first.ms_per_frame
    if len(full):
        best = full.iloc[0]
        made |= best[["method", "substeps", "iterations", "error", "ms_per_frame"]].to_dict()
        if len(reduced):
            ratios = (best[processes] / first[processes]).astype(float).dropna()
            made |= zip(SPEEDUP, median_interval(ratios), strict=True)
        others = full[full.method != best.method]
        if len(others):
            second = others.iloc[0]
            made |= {"second": second.method, "second_ms": second.ms_per_frame}
            made["margin"] = second.ms_per_frame / best.ms_per_frame
    return made


def _pays(curve: pd.DataFrame) -> dict[str, object]:
    """Columns `PAYS`: smallest mesh from which on a reduction pays in every motion, or none."""
    # NaN where one motion is not reached
    every = curve.assign(plain=curve.plain_ms / curve.reduced_ms)
    worst = every.groupby("vertices")[["plain", "reduced_speedup"]].agg(
        lambda speedups: speedups.min(skipna=False)
    )
    sizes = worst.index.to_numpy(float)
    plain, best = worst.to_numpy(float).T
    last = every[every.vertices == sizes[-1]]
    values = (
        _pays_from(sizes, plain),
        _pays_from(sizes, best),
        len(last),
        int(last.reduced_speedup.notna().sum()),
        last.reduced_speedup.median(),
        last.reduced_speedup_low.min(),
        last.reduced_speedup_high.max(),
    )
    return dict(zip(PAYS, values, strict=True))


def _pays_from(sizes: np.ndarray, speedups: np.ndarray) -> int | None:
    """Smallest mesh from which on all ``speedups`` exceed one."""
    losing = np.flatnonzero(~(speedups > 1.0))
    first = int(losing[-1]) + 1 if len(losing) else 0
    return int(sizes[first]) if first < len(sizes) else None
