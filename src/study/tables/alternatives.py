"""Table of errors and times of projective dynamics, alternative solvers and reduced models."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import pandas as pd

from pdrom.model.held_out import MOTIONS, PLAYBACK
from study.artifact import paths
from study.artifact.reads import Every, Recorded
from study.experiments.alternatives import experiment as settings
from study.tables.kit import results
from study.tables.kit.declaration import estimate, flag, integer, number, shared, table, text, timed
from study.tables.kit.results import Rows

ITERATIONS = integer("iterations", "iterations of each substep; empty: until convergence")
MOTION = text("motion", f"test trajectory, one of: {', '.join(MOTIONS)}")
CASE = ["scene", "factor", "stiffness", "motion"]  # columns that identify a test trajectory
KEYS = [*CASE, *settings.SETTING]  # columns that identify a run: a setting on it
PLAIN, TEN = "projective", 10  # method and iterations of the run that times refer to

# Makes a column of errors with a larger tolerance between machines, as rounding errors change
# which steps the two-level methods reject.
error = partial(number, tolerance=0.3)


@table(
    title="Error and time of projective dynamics and its alternatives",
    columns=(
        *shared("scene factor"),
        integer("vertices", "number of vertices of the simulated mesh"),
        *shared("stiffness"),
        text(
            "method",
            f"solver of a frame; `{settings.CONVERGED}`: to a tolerance; `{PLAYBACK}`: none, "
            "replays the training trajectory; `coarser-mesh`: iterations on a coarser mesh, "
            "`-anderson`: accelerated; `ecsw`: reduced model, `-newton`: to a tolerance",
        ),
        integer("substeps", "number of steps into which a frame is divided"),
        ITERATIONS,
        *shared("training_motions"),
        timed(number("offline_s", "processor time of training, with full-order runs", "s")),
        *shared("k skinning"),
        number("tolerance", "tolerance of the element sampling", compared="exact"),
        *shared("elements_sampled training_residual"),
        replace(MOTION, meaning=f"{MOTION.meaning}, or a validation trajectory"),
        integer("frames", "number of frames over which errors are taken"),
        flag("finite", "no frame of the run blew up", compared="error"),
        *shared("ms_per_frame vertices_ms time_ratio vertices_ratio offline_ratio"),
        integer("processes", "number of processes that timed the run"),
        error("error_implicit", "position error against the converged step"),
        error("deformation_error", "deformation error against the converged step"),
        estimate("implicit_error", "position error of the converged step, by a finer solve"),
        estimate("implicit_deformation_error", "deformation error of the converged step"),
        *shared("mesh_error"),
        results.DAY,
    ),
    reads={
        "parts": Every(paths.ALTERNATIVES),
        "times": Rows(paths.ALTERNATIVE_TIMES),
        "record": Recorded("alternatives"),
    },
)
def alternatives(parts: list[paths.File], times: pd.DataFrame, record: list[Path]) -> pd.DataFrame:
    """One row per trajectory and setting (a method with its numbers), in the order of ``parts``.

    Times are medians over all timing processes. `with_recorded` appends rows of ``record``.
    """
    rows = results.joined(parts)
    if len(rows):
        rows, ms, plain = beside(rows, times)
        whole, ratio = ms.median(axis=1), (ms / plain).median(axis=1)
        rows = rows.assign(ms_per_frame=whole, processes=ms.count(axis=1), time_ratio=ratio)
        rows["vertices_ratio"] = ratio / whole * rows.vertices_ms
        rows["offline_ratio"] = 1e3 * (ratio / whole) * rows.offline_s
    return results.with_recorded(rows, record, alternatives.columns)


def beside(
    rows: pd.DataFrame, times: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Return ``rows`` with the column ``vertices_ms``, their frame times, and those of `PLAIN`.

    The two data frames of times (ms) have a column per timing process and the index of the rows.
    """
    wide = times.set_index([*KEYS, "process"]).ms_per_frame.unstack("process")
    wide["vertices_ms"] = times.groupby(KEYS, dropna=False).vertices_ms.median()
    own = rows.drop(columns="vertices_ms", errors="ignore")
    made = own.merge(wide.reset_index(), on=KEYS, how="left")
    ms = made[[name for name in wide.columns if name != "vertices_ms"]]
    ten = (made.method == PLAIN) & (made.substeps == 1) & (made.iterations == TEN)
    plain = ms[ten].reindex(ms.index).groupby([made[key] for key in CASE]).transform("max")
    return made.drop(columns=ms.columns), ms, plain
