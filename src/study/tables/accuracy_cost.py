"""Tables of error and time: each method and size, where reductions save time.

Errors are taken against one of two reference runs; only rows with the same one are comparable. For
``fom`` and ``fom-anderson``, the reference is a full-order run with converged frames (K -> infinity
local/global iterations), for all other methods the scene's own full-order run with its finite K.

Among the other methods, ``full`` without a position subspace is the scene's own full-order run,
with error zero by definition. ``fewer-iterations`` is the full-order run with fewer iterations,
which a reduction must beat. ``fom-anderson`` is a full-order run with Anderson acceleration.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.reads import Every, Setting, TableOf
from study.experiments.kit.base import ANDERSON, FOM
from study.tables.kit import results
from study.tables.kit.declaration import count, flag, integer, number, shared, table, timed
from study.tables.kit.results import FAILED, joined, trained, with_held_out

FEWER = "fewer-iterations"
_MODEL = ["scene", "position_basis", "k", "method"]
_POINT = ["relative_error_within_horizon", "ms_per_frame"]


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
        *shared("velocity_error relative_shape_error energy_drift"),
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
    frame_times: pd.DataFrame,
    iterations: Mapping[str, int],
    **files: list[paths.File],
) -> pd.DataFrame:
    """One row for each full-order run, and for each reduced run with a time and an error.

    The column ``pareto`` compares rows of the same scene whose errors have the same reference.
    """
    times = results.timings_in_one_time(files["timings"], frame_times)
    times = times[times.implementation == "compiled"]
    full = times[times.method.isna()].copy()
    full = full.assign(method="full", position_basis="full", relative_error_within_horizon=0.0)
    sweep = _sweep(results.joined(files["sweeps"]), times)
    points = results.trained(reruns).dropna(subset=_POINT)
    points = results.with_held_out(points.assign(iterations=points.scene.map(iterations)), reruns)
    known = results.joined(files["models"]).reindex(columns=[*_MODEL, "error_converged"])
    known = known.astype({"k": "Int64"})
    points = points.merge(known, on=_MODEL, how="left")
    own = sweep[sweep.method == FOM].set_index(["scene", "iterations"]).error_converged
    full["error_converged"] = [own.get((scene, iterations[scene]), np.nan) for scene in full.scene]
    parts = [full.assign(iterations=full.scene.map(iterations)), points, sweep]
    points = pd.concat([part for part in parts if len(part)], ignore_index=True)
    against_converged = points.method.isin([FOM, ANDERSON])
    for _, rows in points.groupby(["scene", against_converged], sort=False):
        points.loc[rows.index, "pareto"] = pareto(*rows[_POINT].to_numpy(float).T)
    order = points.scene.map({scene: i for i, scene in enumerate(iterations)})
    return points.iloc[np.argsort(order, kind="stable")]


def _sweep(errors: pd.DataFrame, times: pd.DataFrame) -> pd.DataFrame:
    """Full-order runs; those of `FOM` with fewer iterations than the scene's also as `FEWER`."""
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


def pareto(error: Sequence[float], cost: Sequence[float]) -> list[bool]:
    """Whether points are Pareto-optimal: no other is as good in both values and better in one."""
    return [
        not any((e <= a) & (c <= b) & ((e < a) | (c < b)) for e, c in zip(error, cost, strict=True))
        for a, b in zip(error, cost, strict=True)
    ]


# Columns that identify a curve (time of the local step over size r); its rows differ only in r.
CURVE = ["scene", "group", "method", "factor"]
OWN_MESH = "1"  # value of the column ``factor`` for a scene's configured mesh
SHARE = 1e-3  # table payoff omits groups with at most this share of all forces in a scene
_ERROR = "relative_error_within_horizon"


@table(
    title="Reduced local steps against the full one, and where they stop paying",
    columns=(
        *shared("scene group method"),
        number("factor", "on the vertices along a side of the scene's own mesh", compared="exact"),
        *shared("vertices elements r"),
        timed(number("local_ms", "time of the reduced local step", "ms")),
        timed(number("full_ms", "time of the full local step of the group", "ms")),
        timed(number("ratio", "the first over the second")),
        timed(integer("breakeven_r", "size from which the reduction costs more, of the curve")),
        timed(number("solve_ratio", "the solve alone over the full local step")),
        timed(number("lift_ratio", "the reconstruction alone over the full local step")),
    ),
    reads={"own": Every(paths.BREAK_EVEN), "sized": Every(paths.BREAK_EVEN_SIZED)},
)
def breakeven(own: list[paths.File], sized: list[paths.File]) -> pd.DataFrame:
    """One row per scene, group, method, mesh and size r: local-step times and break-even size.

    ``breakeven_r``, the size from which on the reduction is not faster, is equal in rows that only
    differ in r. It is empty if the reduction is faster at the largest size (full rank), and the
    smallest size if it is never faster.
    """
    rows = joined([*own, *(file for file in sized if file["factor"] != OWN_MESH)])
    if rows.empty:
        return rows
    for part, name in (("local", "ratio"), ("solve", "solve_ratio"), ("lift", "lift_ratio")):
        rows[name] = rows[f"{part}_ms"] / rows.full_ms
    sizes = [
        pd.Series(break_even(*curve.sort_values("r")[["r", "ratio"]].to_numpy().T), curve.index)
        for _, curve in rows.groupby(CURVE, sort=False)
    ]
    return rows.assign(breakeven_r=pd.concat(sizes))


def break_even(r: Sequence[int], ratio: Sequence[float]) -> int | None:
    """Smallest size from which on the reduced local step costs at least as much as the full one.

    The ratio of both times at each size ``r`` (ascending) is interpolated linearly between the last
    size with a ratio below one and the next. Return None if the ratio is below one at the largest
    size; if it never is, the smallest size.
    """
    sizes, values = np.asarray(r, dtype=float), np.asarray(ratio, dtype=float)
    below = np.flatnonzero(values < 1.0)
    if len(below) == 0:
        return int(sizes[0])
    last = below[-1]
    if last == len(values) - 1:
        return None
    (a, b), (low, high) = sizes[last : last + 2], values[last : last + 2]
    return int(np.ceil(a + (b - a) * (1.0 - low) / (high - low) - 1e-9))


@table(
    title="Where reductions pay and where they lose to the full order",
    columns=(
        *shared("position_basis method"),
        count("scenes", "scenes (and groups) with a timed run"),
        count("accurate", "those with a run whose error before the horizon is at most a tenth"),
        timed(integer("pays", "those among them with an accurate run faster than the full order")),
        timed(integer("loses", "those whose accurate runs are all slower")),
        timed(number("best_speedup", "median over them of the fastest accurate run's speed-up")),
        timed(number("least_speedup", "the smallest of them")),
        timed(number("most_speedup", "the largest of them")),
        timed(number("error_train", "median over all, of the fastest accurate run or the best")),
        timed(number("error_heldout", "median of the same runs held out, each over its motions")),
        integer("heldout", "scenes (and groups) with a held-out motion"),
        timed(number("error_heldout_low", "median of the least error of each over its motions")),
        timed(number("error_heldout_high", "median of the largest")),
        *shared("playback_error"),
        count("accurate_heldout", "those whose most accurate size has at most a tenth held out"),
        timed(integer("pays_heldout", "those that pay whose run has at most a tenth held out")),
    ),
    reads={
        "reruns": TableOf("reduced_reruns"),
        "points": TableOf("accuracy_cost"),
        "effects": TableOf("effects_cost"),
    },
)
def payoff(reruns: pd.DataFrame, points: pd.DataFrame, effects: pd.DataFrame) -> pd.DataFrame:
    """One row per position basis and method, which summarises its timed runs of all scenes.

    For each scene and group, a size is chosen in the training motion (that of the fastest accurate
    run, or else of the most accurate run) and evaluated on held-out motions. Groups with at most
    `SHARE` of all forces in a scene are left out. The first row is the full order with fewer
    iterations (from ``points``); as it needs no training, its held-out columns are empty. Speed-ups
    are relative to the scene's own full-order run.
    """
    shares = effects.set_index(["scene", "effect"]).force_share
    weak = shares.index[shares <= SHARE]
    runs = trained(reruns)
    runs = runs[runs.speedup.notna() & runs.max_extent.notna()]
    runs = runs[~pd.MultiIndex.from_frame(runs[["scene", "group"]]).isin(weak)]
    runs = pd.concat([_fewer(points), with_held_out(runs, reruns)], ignore_index=True)
    rows = []
    for (basis, method), own in runs.groupby(["position_basis", "method"], sort=False):
        accurate = own[own[_ERROR] <= FAILED]
        fastest = accurate.sort_values("speedup").groupby(["scene", "group"]).tail(1)
        speed = fastest.speedup.to_numpy(float)
        best = own.sort_values(_ERROR, kind="stable").groupby(["scene", "group"]).head(1)
        seen = best[best.error_heldout.notna()]
        # one run per scene and group, accurate or not: medians of all methods cover the same groups
        every = pd.concat([fastest, best[~(best[_ERROR] <= FAILED)]])
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
            "error_train": every[_ERROR].fillna(np.inf).median(),
            "error_heldout": every.error_heldout.median(),
            "heldout": len(seen),
            "error_heldout_low": every.error_heldout_low.median(),
            "error_heldout_high": every.error_heldout_high.median(),
            "playback_error": every.playback_error.median(),
            "accurate_heldout": int((seen.error_heldout <= FAILED).sum()),
            "pays_heldout": int(np.sum((speed > 1.0) & (fastest.error_heldout <= FAILED))),
        })  # fmt: skip
    return pd.DataFrame(rows)


def _fewer(points: pd.DataFrame) -> pd.DataFrame:
    """Rows `FEWER` of ``points``, with speed-ups over the scene's run with all its iterations."""
    full = points[(points.method == "full") & (points.position_basis == "full")]
    fewer = points[points.method == FEWER]
    speedup = fewer.scene.map(full.set_index("scene").ms_per_frame) / fewer.ms_per_frame
    return fewer.assign(group="all", speedup=speedup)
