"""Table winners: the cheapest way to an error, and from what size on a reduction is cheaper."""

from collections.abc import Sequence

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting, TableOf
from study.experiments.alternatives.settings import OWN, REDUCED, REDUCTIONS
from study.tables.alternatives import ITERATIONS, MOTION, STIFFNESS, SUBSTEPS, beside
from study.tables.kit.declaration import compared, integer, number, table, text, timed
from study.tables.kit.intervals import median_interval
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import METHOD, MS_PER_FRAME, SCENE, VERTICES

REFERENCES = ("implicit", "continuous")
CASE = ["scene", "vertices", "stiffness", "motion"]
SPEEDUP = ("reduced_speedup", "reduced_speedup_low", "reduced_speedup_high")
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
        timed(number("own_ms", f"time of the fastest plain one trained on {OWN}", "ms")),
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
    return pd.DataFrame(found, columns=winners.column_names)


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
        own = reduced[(reduced.method == REDUCED) & (reduced.trained_on == OWN)]
        first = reduced.iloc[0]
        made |= {f"reduced_{key}": first[key] for key in ("method", "trained_on", "iterations")}
        made |= {"reduced_ms": first.ms_per_frame, "own_ms": own.ms_per_frame.min()}
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
