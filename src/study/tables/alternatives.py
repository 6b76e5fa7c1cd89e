"""Errors and times of projective dynamics, of alternative solvers and of reductions.

Table winners has the fastest full-order method for each allowed error, and mesh sizes where
reductions win.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.model.held_out import MOTIONS, PLAYBACK
from study.artifact import paths
from study.artifact.reads import Every, Recorded, Setting, TableOf
from study.experiments.alternatives import experiment as settings
from study.tables.kit.declaration import flag, integer, interval, number, shared, table, text, timed
from study.tables.kit.results import DAY, joined, median_interval, with_recorded

STIFFNESS = number("stiffness", "factor on all weights of the scene", compared="exact")
SUBSTEPS = integer("substeps", "steps that a frame is divided into")
ITERATIONS = integer("iterations", "iterations of each substep")

MOTION = text("motion", f"held-out motion, one of: {', '.join(MOTIONS)}")
# Columns that identify a candidate (a solver with its settings); its rows differ in the motion.
CANDIDATE = ["scene", "factor", "stiffness", *settings.SETTING]

# Relative difference of errors that is allowed between machines: rounding errors decide which steps
# the two-level methods reject.
ERROR_TOLERANCE = 0.3
REFERENCES = ("implicit", "continuous")
CASE = ["scene", "vertices", "stiffness", "motion"]
SPEEDUP = ("reduced_speedup", "reduced_speedup_low", "reduced_speedup_high")
CURVE = ["scene", "stiffness", "reference", "limit"]
PLAIN = "projective"
KNOWN = 3.0  # least limit of errors / error of the reference run "continuous"


@table(
    title="Error and time of the alternatives to projective dynamics",
    columns=(
        *shared("scene"),
        number("factor", "on the vertices along a side of the scene's own mesh", compared="exact"),
        *shared("vertices"),
        STIFFNESS,
        text(
            "method",
            f"how a frame is solved; {settings.CONVERGED}: to the end; {PLAYBACK}: not, "
            f"the recorded training motion is shown; {settings.REDUCED}: "
            f"reduced, {settings.ACCELERATED}: and accelerated in the subspace",
        ),
        SUBSTEPS,
        ITERATIONS,
        integer("training_motions", "motions that a reduction is trained on"),
        timed(number("offline_s", "processor time of its training, full-order runs included", "s")),
        *shared("k elements_sampled training_residual"),
        MOTION,
        integer("frames", "frames that errors are taken over"),
        flag("finite", "no frame blew up", compared="error"),
        *shared("ms_per_frame vertices_ms"),
        integer("processes", "processes that timed it, all in the first motion"),
        number("error_implicit", "against the converged step", tolerance=ERROR_TOLERANCE),
        number("error_continuous", "against continuous time: the total", tolerance=ERROR_TOLERANCE),
        replace(*shared("reference_error"), meaning="estimated error of that motion"),
        number("span_error", "error of the nearest motion in the subspace of a reduction"),
        DAY,
    ),
    reads={
        "parts": Every(paths.ALTERNATIVES),
        "times": Every(paths.ALTERNATIVE_TIMES),
        "record": Recorded("alternatives"),
    },
)
def alternatives(
    parts: list[paths.File], times: list[paths.File], record: list[Path]
) -> pd.DataFrame:
    """One row per held-out motion and solver with its settings, in the order of files ``parts``.

    Times are medians over all timing processes. `with_recorded` appends rows of ``record``.
    """
    rows = joined(parts)
    if len(rows):
        rows, processes = beside(rows, joined(times))
        ms = rows[processes]
        rows = rows.assign(ms_per_frame=ms.median(axis=1), processes=ms.count(axis=1))
    return with_recorded(rows, record)


def beside(rows: pd.DataFrame, times: pd.DataFrame) -> tuple[pd.DataFrame, list[int]]:
    """Add a column of frame times (ms) per timing process to ``rows``; also return their names."""
    wide = times.set_index([*CANDIDATE, "process"]).ms_per_frame.unstack("process")
    wide["vertices_ms"] = times.groupby(CANDIDATE, dropna=False).vertices_ms.median()
    own = rows.drop(columns="vertices_ms", errors="ignore")
    return own.merge(wide.reset_index(), on=CANDIDATE, how="left"), list(wide.columns[:-1])


# All columns about the fastest method are marked as timed: measured times decide which one it is.
@table(
    title="Which full-order method reaches an error in the shortest time",
    columns=(
        *shared("scene vertices"),
        STIFFNESS,
        MOTION,
        text("reference", "what the error is taken against: implicit or continuous"),
        number("limit", "error that is allowed", compared="exact"),
        timed(text("method", "the fastest full-order method within the limit; no reduction")),
        timed(SUBSTEPS),
        timed(ITERATIONS),
        timed(number("error", "error that it has")),
        *shared("ms_per_frame"),
        timed(text("second", "the next best of the other full-order methods")),
        timed(number("margin", "time of the second over that of the first")),
        timed(number("plain_ms", "time of one-step projective dynamics, if it reaches it", "ms")),
        timed(number("reduced_error", "smallest error of the reduction")),
        timed(number("reduced_ms", "time of a frame of the reduction, if it reaches it", "ms")),
        timed(number("reduced_vertices_ms", "of it, the positions of all vertices", "ms")),
        timed(number("reduced_speedup", "time of the best full order over that of the reduction")),
        *map(timed, interval("reduced_speedup_low reduced_speedup_high")),
        timed(text("reduced_method", "the reduction that is the fastest to reach it")),
        timed(integer("reduced_training_motions", "the motions that it is trained on")),
        timed(integer("reduced_iterations", "its iterations of a substep")),
        timed(number("reduced_pays_after", "frames after which its training is paid off")),
        timed(integer("from_plain", "vertices from which on a reduction beats plain iterations")),
        timed(integer("from_best", "vertices from which on it beats the best full-order method")),
        integer("motions", "held-out motions"),
        timed(integer("reached", "motions in which it reaches the error on the largest mesh")),
        timed(number("speedup", "median of reduced_speedup over the motions that reach it")),
        timed(number("speedup_low", "least 2.5 % quantile of a motion")),
        timed(number("speedup_high", "largest 97.5 % quantile of a motion")),
        DAY,
    ),
    reads={
        "rows": TableOf("alternatives"),
        "times": Every(paths.ALTERNATIVE_TIMES),
        "limits": Setting("alternatives.errors"),
        "record": Recorded("winners"),
    },
)
def winners(
    rows: pd.DataFrame, times: list[paths.File], limits: Sequence[float], record: list[Path]
) -> pd.DataFrame:
    """One row per scene, mesh, stiffness, motion, reference and error limit.

    Column ``method`` is empty if no full-order method that was timed reaches the limit. Rows of the
    reference "continuous" have only limits of at least `KNOWN` times this reference's own error.
    """
    found = []
    rows = rows[rows.recorded.isna()]
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
    made = pd.DataFrame(found, columns=winners.column_names)
    if len(made):
        curves = made.groupby(CURVE, sort=False)
        pays = [{**dict(zip(CURVE, k, strict=True)), **_pays(own)} for k, own in curves]
        rest = made.columns.difference([name for name in pays[0] if name not in CURVE])
        made = made[rest].merge(pd.DataFrame(pays), on=CURVE, how="left")
    return with_recorded(made, record)


def _best(rows: pd.DataFrame, limit: float, processes: list[int]) -> dict[str, object]:
    """Columns about the two fastest full-order methods and the fastest reduction within ``limit``.

    A speed-up is a median over ``processes`` (columns of times) of full-order / reduced time.
    """
    reaching = rows[rows.error <= limit].sort_values("ms_per_frame", kind="stable")
    inside = reaching.method.isin(settings.REDUCTIONS)
    full, reduced = reaching[~inside], reaching[inside]
    made: dict[str, object] = {
        "reduced_error": rows.error[rows.method.isin(settings.REDUCTIONS)].min()
    }
    plain = reaching[(reaching.method == PLAIN) & (reaching.substeps == 1)]
    if len(plain):
        made["plain_ms"] = plain.ms_per_frame.iloc[0]
    if len(reduced):
        first = reduced.iloc[0]
        same = ("method", "training_motions", "iterations", "vertices_ms")
        made |= {f"reduced_{key}": first[key] for key in same}
        made["reduced_ms"] = first.ms_per_frame
    if len(full):
        best = full.iloc[0]
        made |= best[["method", "substeps", "iterations", "error", "ms_per_frame"]].to_dict()
        if len(reduced):
            ratios = (best[processes] / first[processes]).astype(float).dropna()
            made |= zip(SPEEDUP, median_interval(ratios), strict=True)
            saved = best.ms_per_frame - first.ms_per_frame
            made["reduced_pays_after"] = 1e3 * first.offline_s / saved if saved > 0.0 else None
        others = full[full.method != best.method]
        if len(others):
            second = others.iloc[0]
            margin = second.ms_per_frame / best.ms_per_frame
            made |= {"second": second.method, "margin": margin}
    return made


def _pays(curve: pd.DataFrame) -> dict[str, object]:
    """Columns: mesh sizes from which on reductions are faster, speed-ups on the largest mesh."""
    # least speed-up of all motions on a mesh; NaN if a method misses the error limit in one motion
    every = curve.assign(plain=curve.plain_ms / curve.reduced_ms)
    worst = every.groupby("vertices")[["plain", "reduced_speedup"]].agg(
        lambda speedups: speedups.min(skipna=False)
    )
    sizes = worst.index.to_numpy(float)
    plain, best = worst.to_numpy(float).T
    last = every[every.vertices == sizes[-1]]
    return {
        "from_plain": _pays_from(sizes, plain),
        "from_best": _pays_from(sizes, best),
        "motions": len(last),
        "reached": int(last.reduced_speedup.notna().sum()),
        "speedup": last.reduced_speedup.median(),
        "speedup_low": last.reduced_speedup_low.min(),
        "speedup_high": last.reduced_speedup_high.max(),
    }


def _pays_from(sizes: np.ndarray, speedups: np.ndarray) -> int | None:
    """Smallest of ``sizes`` from which on all ``speedups`` exceed one; None if there is none."""
    losing = np.flatnonzero(~(speedups > 1.0))
    first = int(losing[-1]) + 1 if len(losing) else 0
    return int(sizes[first]) if first < len(sizes) else None
