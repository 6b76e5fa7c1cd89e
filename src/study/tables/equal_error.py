"""Tables of reduced models and of the fastest full-order settings that are as accurate.

A setting is a method with its parameters; full-order settings include coarser meshes.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pdrom.model.held_out import MOTIONS, PLAYBACK
from pdrom.reduction.settings import pareto
from study.artifact import paths
from study.artifact.reads import Recorded, Setting, TableOf
from study.experiments.alternatives.experiment import CONVERGED, REDUCTIONS, SETTING, ReducedModel
from study.tables import alternatives as runs
from study.tables.kit import declaration, results
from study.tables.kit.declaration import estimate, flag, integer, number, shared, table, text, timed
from study.tables.kit.results import Rows

# The reduced model of `equal_error`; if the training has fewer modes, the nearest number.
FIXED = ReducedModel(training_motions=(1, 2))
# Column of speed-ups -> column of the error that full-order settings must not exceed.
AHEAD = {
    "ahead": "validation_error", "ahead_test": "position_error",
    "ahead_deformation": "deformation_error",
}  # fmt: skip
(RATIO,) = shared("time_ratio")
PARTS = REDUCED, COARSER, SAME = "reduced", "coarser mesh", "same mesh"
OWN = integer("vertices", "number of vertices of the scene's mesh")


def fastest(prefix: str, where: str) -> list[declaration.Column]:
    """Columns, with ``prefix``, of the fastest full-order setting and the speed-up over it."""
    made = [
        text("method", f"fastest full-order setting {where} with at most this position error"),
        *([integer("vertices", "number of vertices of its mesh")] if prefix == COARSER[:7] else []),
        integer("substeps", "steps per frame of this setting"),
        integer("iterations", "iterations per step of this setting"),
        number("error", "position error of this setting"),
        number("speedup", "time of this setting over time of the reduced model, median"),
        *declaration.interval("speedup_low speedup_high"),
        flag("reached", "a setting is as accurate; otherwise the row has the most accurate one"),
    ]
    return [timed(replace(column, name=f"{prefix}_{column.name}")) for column in made]


@table(
    title="Speed-ups over the fastest full-order settings that are at least as accurate",
    columns=(
        *shared("scene factor"),
        OWN,
        *shared("stiffness"),
        runs.MOTION,
        text("elements", "elements of the constraints: springs, triangles or tetrahedra"),
        text("method", "reduced model: ecsw with few iterations, ecsw-newton to a tolerance"),
        runs.ITERATIONS,
        *shared("training_motions k"),
        number("position_error", "error against the converged step, all frames; inf: blew up"),
        *shared("deformation_error"),
        estimate("implicit_error", "position error of the converged step"),
        flag("known", "implicit_error is at most a third of the position error", compared="error"),
        *shared("time_ratio vertices_ratio offline_ratio mesh_error"),
        *fastest("same", "on the same mesh"),
        *fastest("coarser", "on the same or a coarser mesh"),
        timed(number("pays_after", "frames that save the training time, against coarser_method")),
        results.DAY,
    ),
    reads={
        "rows": TableOf("alternatives"),
        "times": Rows(paths.ALTERNATIVE_TIMES),
        "elements": Setting("compared_elements"),
        "record": Recorded("equal_error"),
    },
)
def equal_error(
    rows: pd.DataFrame, times: pd.DataFrame, elements: Mapping[str, str], record: list[Path]
) -> pd.DataFrame:
    """One row per test trajectory and reduced model with the settings of `FIXED`.

    It is compared with all timed full-order settings that have at most the model's position error
    over all frames of this trajectory. Speed-ups are ratios of times in the same process.
    """
    rows, ms, _ = _of_this_run(rows, times)
    found = []
    for labels, case in rows.groupby(runs.CASE, sort=False):
        scene, *_, motion = labels
        vertices, measured = case.vertices.max(), case[case.ms_per_frame.notna()]
        own = case[(case.method == CONVERGED) & (case.vertices == vertices)]
        full = measured[~measured.method.isin([CONVERGED, PLAYBACK, *REDUCTIONS])]
        full = full.dropna(subset="error_implicit")
        for model in _fixed(measured) if motion in MOTIONS and len(full) else ():
            row = {name: model[name] for name in equal_error.column_names if name in model}
            row |= {
                "vertices": vertices, "elements": elements[scene],
                "position_error": model.error, "mesh_error": own.mesh_error.max(),
                "known": model.implicit_error <= results.THIRD * model.error,
            }  # fmt: skip
            row |= _beside(full[full.vertices == vertices], model, ms, "same")
            row |= _beside(full, model, ms, "coarser")  # also replaces "pays_after"
            found.append(row)
    made = pd.DataFrame(found, columns=equal_error.column_names)
    return results.with_recorded(made, record, equal_error.columns)


def _of_this_run(
    rows: pd.DataFrame, times: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """`alternatives.beside` for rows of this run; errors of runs that blew up are infinite."""
    rows = rows[rows.recorded.isna()]
    if rows.empty:
        return rows, pd.DataFrame(), pd.DataFrame()
    blown = ~rows.finite.astype(bool)
    rows = rows.assign(error=rows.error_implicit.mask(blown, np.inf))
    return runs.beside(rows, times)


def _fixed(rows: pd.DataFrame) -> Iterator[Any]:
    """Yield the reduced models among ``rows`` of a case that have the settings of `FIXED`."""
    own = rows[rows.method.isin(REDUCTIONS) & rows.error.notna()]
    own = own[(own.skinning == FIXED.skinning) & np.isclose(own.tolerance, FIXED.tolerance)]
    own = own[own.training_motions.isin(FIXED.training_motions)]
    own = own[own.iterations.isna() | own.iterations.isin(FIXED.iterations)]
    for _, same in own.groupby(["method", "training_motions"], sort=False):
        yield same.loc[(same.k - FIXED.modes).abs().idxmin()]


def _beside(full: pd.DataFrame, model: Any, ms: pd.DataFrame, prefix: str) -> dict[str, Any]:
    """Values of the columns `fastest`, chosen from settings ``full``; ``ms`` are all times."""
    if full.empty:
        return {}
    able = full[full.error_implicit <= model.error]
    best = full.loc[able.ms_per_frame.idxmin() if len(able) else full.error_implicit.idxmin()]
    ratios = (ms.loc[best.name] / ms.loc[model.name]).astype(float).dropna()
    made = dict(best[["method", "vertices", "substeps", "iterations"]])
    made |= {"error": best.error_implicit, "reached": len(able) > 0}
    ends = ("speedup", "speedup_low", "speedup_high")
    made |= zip(ends, results.median_interval(ratios), strict=True)
    saved = best.time_ratio - model.time_ratio
    after = model.offline_ratio / saved if saved > 0.0 else None
    return {f"{prefix}_{key}": value for key, value in made.items()} | {"pays_after": after}


@table(
    title="Best settings of each scene, chosen on validation trajectories",
    columns=(
        *shared("scene factor"),
        OWN,
        text("part", f"settings that are compared, one of: {', '.join(PARTS)}"),
        *map(
            timed,
            (
                text("method", "solver of a frame, see alternatives"),
                integer("simulated", "number of vertices of the simulated mesh"),
                runs.ITERATIONS,
                *shared("k skinning"),
                number("tolerance", "tolerance of the element sampling"),
                *shared("training_motions"),
                number("validation_error", "largest position error on validation trajectories"),
                number("validation_deformation", "largest deformation error on these trajectories"),
                number("position_error", "largest position error on test trajectories"),
                number("deformation_error", "largest deformation error on test trajectories"),
                replace(RATIO, meaning=f"{RATIO.meaning}, median"),
                *shared("offline_ratio"),
                number(
                    "ahead",
                    "time of the fastest full-order setting on any mesh with at most this "
                    "validation error, over that of the reduced model; empty: there is none",
                ),
                number("ahead_test", "as ahead, with at most this test position error"),
                number("ahead_deformation", "as ahead, with at most this test deformation error"),
            ),
        ),
        results.DAY,
    ),
    reads={
        "rows": TableOf("alternatives"),
        "times": Rows(paths.ALTERNATIVE_TIMES),
        "record": Recorded("frontier"),
    },
)
def frontier(rows: pd.DataFrame, times: pd.DataFrame, record: list[Path]) -> pd.DataFrame:
    """One row per setting, if no setting of its part has a smaller validation error and time.

    Scenes without validation trajectories or with changed weights have no rows. A run that blew up
    has an infinite error.
    """
    rows, ms, plain = _of_this_run(rows, times)
    parts = [
        _frontier(own, ms.loc[own.index] / plain.loc[own.index])
        for _, own in rows[rows.stiffness == 1.0].groupby(["scene", "factor"], sort=False)
        if {*own.motion} > {*MOTIONS}
    ]
    made = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
    return results.with_recorded(made, record, frontier.columns)


def _frontier(rows: pd.DataFrame, ratios: pd.DataFrame) -> pd.DataFrame:
    """Rows of table frontier for ``rows`` of a mesh; ``ratios``: times over the plain time."""
    vertices = rows.vertices.max()
    rows = rows[~rows.method.isin([CONVERGED, PLAYBACK])]
    setting = rows.groupby(SETTING, sort=False, dropna=False).ngroup()
    made = rows.groupby(setting).first()
    made = made.assign(simulated=made.vertices, vertices=vertices)
    shape = rows.deformation_error.mask(np.isinf(rows.error), np.inf)
    errors = pd.DataFrame({"position": rows.error, "shape": shape})
    largest = errors.groupby([rows.motion.isin(MOTIONS), setting]).max()
    made[["validation_error", "validation_deformation"]] = largest.loc[False]
    made[["position_error", "deformation_error"]] = largest.loc[True]
    times = ratios.loc[rows.index].stack()
    made["time_ratio"] = times.groupby(setting[times.index.get_level_values(0)].to_numpy()).median()
    made["offline_ratio"] = rows.offline_ratio.groupby(setting).median()
    made = made[np.isfinite(made.validation_error) & made.time_ratio.notna()]
    reduced, coarser = made.method.isin(REDUCTIONS), made.simulated < vertices
    made["part"] = np.select([reduced, coarser], [REDUCED, COARSER], SAME)
    full = made[~reduced]
    for name, error in AHEAD.items():
        least = [full.time_ratio[full[error] <= limit].min() for limit in made[error]]
        made[name] = (least / made.time_ratio).where(reduced)
    best = [
        own[pareto(own.validation_error.to_list(), own.time_ratio.to_list())]
        for own in (made[made.part == part].sort_values("time_ratio") for part in PARTS)
    ]
    return pd.concat(best)
