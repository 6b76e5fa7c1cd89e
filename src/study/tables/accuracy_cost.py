"""Tables of error against time: each method and size as a point, and requested tolerances.

The error of a point has one of two references; only rows with the same reference are comparable.
The reference of ``fom`` and ``fom-anderson`` is the full-order run whose frames are converged
(K -> infinity), of every other method the scene's own full-order run with finitely many iterations.

Among the other methods, ``full`` without a position subspace is the scene's own full-order run,
with error zero by definition. ``fewer-iterations`` is the full-order run with fewer iterations,
which a reduction must beat. ``fom-anderson`` is a full-order run with accelerated iterations.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.reads import Every, Setting, TableOf
from study.experiments.kit.base import ANDERSON, FOM
from study.tables.kit import results
from study.tables.kit.declaration import flag, integer, number, shared, table, text, timed

FEWER = "fewer-iterations"
_MODEL = ["scene", "position_basis", "k", "method"]
_POINT = ["relative_error_within_horizon", "ms_per_frame"]
CONVERGED, OWN = "converged", "own iterations"


@table(
    title="Every method and size as a point of accuracy and cost",
    only_with_error=True,
    columns=(
        *shared("scene group method position_basis k r"),
        integer("iterations", "local/global iterations of a frame"),
        *shared("relative_error_within_horizon ms_per_frame"),
        timed(flag("pareto", "no point of the same reference is as good in both, better in one")),
        number(
            "error_converged",
            "error against the run of converged frames: of the full order, whose error before "
            "the horizon may have another reference, and in position subspaces",
            tolerance=0.05,
        ),
        *results.COLUMNS,
        timed(flag("pareto_heldout", "the same by the error held out; full order as it is")),
        *shared("velocity_error relative_shape_error energy_drift contact_delay"),
    ),
    reads={
        "reruns": TableOf("reduced_reruns"),
        "timings": Every(paths.TIMINGS),
        "frame_times": TableOf("frame_times"),
        "sweeps": Every(paths.ITERATIONS),
        "models": Every(paths.SUBSPACES_CONVERGED),
        "iterations": Setting("scene_iterations"),
    },
)
def accuracy_cost(
    reruns: pd.DataFrame,
    timings: list[paths.File],
    frame_times: pd.DataFrame,
    sweeps: list[paths.File],
    models: list[paths.File],
    iterations: Mapping[str, int],
) -> pd.DataFrame:
    """Points of reduced runs with a known error within the horizon and time, and full-order runs.

    A point is Pareto-optimal among the points of its scene whose errors have the same reference.

    Parameters
    ----------
    iterations : scene -> number K of local/global iterations per frame in the scene's settings
    """
    times = results.timings_in_one_time(timings, frame_times)
    times = times[times.implementation == "compiled"]
    full = times[times.method.isna()].copy()
    full = full.assign(method="full", position_basis="full", relative_error_within_horizon=0.0)
    sweep = _sweep(results.joined(sweeps), times)
    points = results.trained(reruns).dropna(subset=_POINT)
    points = results.with_held_out(points.assign(iterations=points.scene.map(iterations)), reruns)
    known = results.joined(models).reindex(columns=[*_MODEL, "error_converged"])
    known = known.astype({"k": "Int64"})
    points = points.merge(known, on=_MODEL, how="left")
    own = sweep[sweep.method == FOM].set_index(["scene", "iterations"]).error_converged
    full["error_converged"] = [own.get((scene, iterations[scene]), np.nan) for scene in full.scene]
    parts = [full.assign(iterations=full.scene.map(iterations)), points, sweep]
    points = pd.concat([part for part in parts if len(part)], ignore_index=True)
    # "full" is also the method name of models that reduce the positions but not the projections
    unreduced = (points.method == "full") & (points.position_basis == "full")
    reduced = points.method.isin(reruns.method) & ~unreduced
    unseen = points[results.MEDIAN].where(reduced, points.relative_error_within_horizon)
    errors = {"pareto": points.relative_error_within_horizon, "pareto_heldout": unseen}
    for name, error in errors.items():
        points[name] = False
        known = points[error.notna()]
        for _, rows in known.groupby(["scene", reference_of(known)], sort=False):
            own = error[rows.index].to_numpy(float)
            points.loc[rows.index, name] = pareto(own, rows.ms_per_frame.to_numpy(float))
    order = points.scene.map({scene: i for i, scene in enumerate(iterations)})
    return points.iloc[np.argsort(order, kind="stable")]


def _sweep(errors: pd.DataFrame, times: pd.DataFrame) -> pd.DataFrame:
    """Full-order runs for every K against the converged run, and again as fewer-iterations."""
    full = times[times.method.isna() | times.method.isin([FOM, ANDERSON])]
    cost = full[["scene", "method", "iterations", "ms_per_frame"]]
    cost = cost.fillna({"method": FOM})
    errors = errors.dropna(subset=["iterations"])
    errors["method"] = (errors.window > 0).map({True: ANDERSON, False: FOM})
    errors = errors.merge(cost, on=["scene", "method", "iterations"])
    own = full[full.method.isna()].set_index("scene").iterations
    early = (errors.iterations < errors.scene.map(own)) & (errors.method == FOM)
    every = errors.assign(relative_error_within_horizon=errors.error_converged)
    fewer = errors[early].assign(method=FEWER, relative_error_within_horizon=errors.error_scene)
    points = pd.concat([every, fewer], ignore_index=True)
    points = points.assign(position_basis="full", k=None, r=None)
    return points.dropna(subset=_POINT)


def reference_of(points: pd.DataFrame) -> pd.Series:
    """Reference of the error in each row of ``points``: `CONVERGED` or `OWN`."""
    return points.method.isin([FOM, ANDERSON]).map({True: CONVERGED, False: OWN})


def pareto(error: Sequence[float], cost: Sequence[float]) -> list[bool]:
    """Whether, for each point, no other is as good in ``error`` and ``cost`` and better in one."""
    return [
        not any((e <= a) & (c <= b) & ((e < a) | (c < b)) for e, c in zip(error, cost, strict=True))
        for a, b in zip(error, cost, strict=True)
    ]


@table(
    title="Requested tolerances and errors reached",
    columns=(
        *shared("scene"),
        text("motion", "held-out motion that was run"),
        number("tolerance", "largest relative error of the positions requested", compared="exact"),
        *shared("vertices"),
        flag("met", "the run says that it is within the tolerance", compared="error"),
        integer("frames", "first frames for which it says so", compared="error"),
        flag("reduced", "a reduction made the run", compared="error"),
        number("error", "error over these frames against the converged implicit step"),
        number("velocity_error", "error of the velocities, likewise"),
        number("playback_error", "error of playback of the training motion, likewise"),
        number("expected", "error in the calibration, times the factor", compared="error"),
        number("estimate", "estimate by checks and a second run, likewise", compared="error"),
        flag("broken", "met, and the error is above the tolerance", compared="error"),
        text("level", "level of accuracy that made the run", compared="error"),
        integer("failed", "levels that were tried before", compared="error"),
        integer("checks", "frames that a more accurate level did as well", compared="error"),
        *shared("ms_per_frame"),
        text(
            "full_level",
            "cheapest full order within the tolerance by the calibration",
            compared="error",
        ),
        number("full_error", "its error over the same frames"),
        timed(number("full_ms", "time of its frame, without checks", "ms")),
        timed(number("over_full", "time of a frame over that")),
        timed(number("own_ms", "time of a frame with the scene's own iterations", "ms")),
        timed(number("over_own", "time of a frame over that")),
    ),
    reads={"runs": Every(paths.REQUESTED_TOLERANCES)},
)
def requested_tolerances(runs: list[paths.File]) -> pd.DataFrame:
    """Rows of all scenes, one per run with a requested tolerance, from the files ``runs``."""
    rows = results.joined(runs)
    if rows.empty:
        return rows
    met = rows.frames > 0
    return rows.assign(
        met=met,
        broken=met & ~(rows.error <= rows.tolerance),
        over_full=rows.ms_per_frame / rows.full_ms,
        over_own=rows.ms_per_frame / rows.own_ms,
    )
