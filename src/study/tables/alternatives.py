"""Errors and times of projective dynamics, of alternative solvers and of reductions.

Table winners names the fastest full-order method within an error, and where reductions win.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.model.held_out import MOTIONS, PLAYBACK
from study.artifact import paths
from study.artifact.reads import Every, Recorded, Setting, TableOf
from study.experiments.alternatives import experiment as settings
from study.tables.kit import results
from study.tables.kit.declaration import flag, integer, interval, number, shared, table, text, timed

STIFFNESS = number("stiffness", "factor on all weights of the scene", compared="exact")
RATIO = "time of a frame over that of plain projective dynamics with ten iterations"
SUBSTEPS = integer("substeps", "steps that a frame is divided into")
ITERATIONS = integer("iterations", "iterations of each substep")

MOTION = text("motion", f"held-out motion, one of: {', '.join(MOTIONS)}")
# Columns that identify a candidate (a solver with its settings); its rows differ in the motion.
MESH = ["scene", "factor", "stiffness"]
CANDIDATE = [*MESH, *settings.SETTING]

# Relative difference of errors that is allowed between machines: rounding errors decide which steps
# the two-level methods reject.
ERROR_TOLERANCE = 0.3
estimated = partial(replace, *shared("reference_error"))  # column of errors of a reference
CASE = ["scene", "vertices", "stiffness", "motion"]
CURVE = ["scene", "stiffness", "reference", "measure", "limit"]
PLAIN, TEN = "projective", 10  # method and iterations that times are compared with
# Reference, measure, columns of the errors that are limited, the same errors of the reference.
MEASURES = (
    ("implicit", results.BOTH, ["error_implicit", "deformation_error"],
     ["implicit_error", "implicit_deformation_error"]),
    ("implicit", results.POSITION, ["error_implicit"], ["implicit_error"]),
    ("continuous", results.POSITION, ["error_continuous"], ["reference_error"]),
)  # fmt: skip


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
        timed(number("time_ratio", RATIO)),
        timed(number("vertices_ratio", "of it, the positions of all vertices")),
        timed(number("offline_ratio", "time of its training over that of one plain frame")),
        integer("processes", "processes that timed it, all in the first motion"),
        number("error_implicit", "against the converged step", tolerance=ERROR_TOLERANCE),
        number(
            "deformation_error",
            "deformation error against the converged step",
            tolerance=ERROR_TOLERANCE,
        ),
        number("error_continuous", "against continuous time: the total", tolerance=ERROR_TOLERANCE),
        estimated(meaning="estimated error of that motion"),
        estimated(name="implicit_error", meaning="of the converged step, by a much finer solve"),
        estimated(name="implicit_deformation_error", meaning="of its shapes"),
        number("span_error", "error of the nearest motion in the subspace of a reduction"),
        results.DAY,
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
    rows = results.joined(parts)
    if len(rows):
        rows, processes = beside(rows, results.joined(times))
        ms = rows[processes]
        rows = rows.assign(ms_per_frame=ms.median(axis=1), processes=ms.count(axis=1))
        own = (rows.method == PLAIN) & (rows.substeps == 1) & (rows.iterations == TEN)
        plain = ms[own].reindex(ms.index).groupby([rows[key] for key in MESH]).transform("max")
        rows["time_ratio"] = (ms / plain).median(axis=1)
        per_ms = rows.time_ratio / rows.ms_per_frame
        rows["vertices_ratio"] = per_ms * rows.vertices_ms
        rows["offline_ratio"] = 1e3 * per_ms * rows.offline_s
    return results.with_recorded(rows, record, alternatives.columns)


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
        results.MEASURE,
        number("limit", "error that is allowed", compared="exact"),
        timed(text("method", "the fastest full-order method within the limit; no reduction")),
        timed(SUBSTEPS),
        timed(ITERATIONS),
        timed(number("error", "error that it has, the larger one of both")),
        timed(number("time_ratio", RATIO)),
        timed(number("reduced_error", "smallest error of the reduction")),
        timed(number("reduced_time_ratio", "the same of the reduction, if it reaches it")),
        timed(number("reduced_vertices_ratio", "of it, the positions of all vertices")),
        timed(number("plain_speedup", "time of one-step projective dynamics over it, if both do")),
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
        results.DAY,
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
    """One row per scene, mesh, stiffness, motion, reference, measure and error limit.

    Column ``method`` is empty if no full-order method that was timed reaches the limit. Limits are
    at least three times the reference's own error. In a rigid motion, the position decides.
    """
    found = []
    rows = rows[rows.recorded.isna()]
    if len(rows):
        rows, processes = beside(rows, results.joined(times))
    for labels, case in rows.groupby(CASE, sort=False):
        named = dict(zip(CASE, labels, strict=True))
        timed_rows = case[case.ms_per_frame.notna()]
        for limit, (reference, measure, errors, own) in product(limits, MEASURES):
            if case[own].max().max() <= results.THIRD * limit:
                known = timed_rows.assign(error=timed_rows[errors].max(axis=1))
                row = {**named, "reference": reference, "measure": measure, "limit": limit}
                found.append({**row, **_best(known, limit, processes)})
    made = pd.DataFrame(found, columns=winners.column_names)
    if len(made):
        curves = made.groupby(CURVE, sort=False)
        pays = [{**dict(zip(CURVE, k, strict=True)), **_pays(own)} for k, own in curves]
        rest = made.columns.difference([name for name in pays[0] if name not in CURVE])
        made = made[rest].merge(pd.DataFrame(pays), on=CURVE, how="left")
    return results.with_recorded(made, record, winners.columns)


def _best(rows: pd.DataFrame, limit: float, processes: list[int]) -> dict[str, object]:
    """Columns about the fastest full-order method and the fastest reduction within ``limit``.

    A speed-up is a median over ``processes`` (columns of times) of full-order / reduced time.
    """
    inside = rows.method.isin(settings.REDUCTIONS)
    made: dict[str, object] = {"reduced_error": rows.error[inside].min()}
    reaching = rows[rows.error <= limit].sort_values("ms_per_frame", kind="stable")
    full, reduced = reaching[~inside[reaching.index]], reaching[inside[reaching.index]]
    plain = full[(full.method == PLAIN) & (full.substeps == 1)]
    if len(reduced):
        first = reduced.iloc[0]
        same = ("method", "training_motions", "iterations", "time_ratio", "vertices_ratio")
        made |= {f"reduced_{key}": first[key] for key in same}
        made["plain_speedup"] = plain.ms_per_frame.min() / first.ms_per_frame
    if len(full):
        best = full.iloc[0]
        made |= best[["method", "substeps", "iterations", "error", "time_ratio"]].to_dict()
        if len(reduced):
            ratios = (best[processes] / first[processes]).astype(float).dropna()
            speedup = [f"reduced_speedup{end}" for end in ("", "_low", "_high")]
            made |= zip(speedup, results.median_interval(ratios), strict=True)
            saved = best.ms_per_frame - first.ms_per_frame
            made["reduced_pays_after"] = 1e3 * first.offline_s / saved if saved > 0.0 else None
    return made


def _pays(curve: pd.DataFrame) -> dict[str, object]:
    """Columns: mesh sizes from which on reductions are faster, speed-ups on the largest mesh."""
    # least speed-up of all motions on a mesh; NaN if a method misses the error limit in one motion
    by_mesh = curve.groupby("vertices")[["plain_speedup", "reduced_speedup"]]
    worst = by_mesh.agg(lambda speedups: speedups.min(skipna=False))
    sizes = worst.index.to_numpy(float)
    plain, best = worst.to_numpy(float).T
    last = curve[curve.vertices == sizes[-1]]
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
