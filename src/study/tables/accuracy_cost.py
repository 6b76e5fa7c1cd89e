"""Tables of error and time: each method and size, where reductions save time.

Errors are taken against the run with converged frames (K -> infinity local/global iterations).
Method ``full`` without a position subspace is the full-order run with the scene's own K, ``fom``
one with another K, ``fom-anderson`` one with Anderson acceleration, ``coarser-mesh`` and
``coarser-mesh-anderson`` are the same on a coarser mesh.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from pdrom.reduction.settings import COARSER, COARSER_ANDERSON, pareto
from study.artifact import paths
from study.artifact.reads import Every, Setting, TableOf
from study.experiments.kit.base import ANDERSON, FOM
from study.tables.kit import declaration, results
from study.tables.kit.declaration import count, flag, integer, number, shared, table, text, timed
from study.tables.kit.results import DEFORMATION, ERROR, EXPERIMENT, FAILED, Rows

_POINT = [ERROR, "ms_per_frame"]


@table(
    title="Every method and size as a point of accuracy and cost",
    only_with_error=True,
    columns=(
        *shared("scene group method position_basis k r"),
        integer("iterations", "local/global iterations of a frame"),
        integer("vertices", "vertices of the mesh that is simulated"),
        *shared("relative_error_within_horizon deformation_error ms_per_frame"),
        timed(flag("pareto", "no point of the scene is as good in error and time, better in one")),
        *shared("reference reference_error reference_deformation_error mesh_error"),
        *results.COLUMNS,
        *shared("velocity_error energy_drift"),
    ),
    reads={
        "reruns": TableOf("reduced_reruns"),
        "timings": Rows(paths.TIMINGS),
        "frame_times": TableOf("frame_times"),
        "sweeps": Rows(paths.ITERATIONS),
        "iterations": Setting("scene_iterations"),
    },
)
def accuracy_cost(
    reruns: pd.DataFrame, timings: pd.DataFrame, frame_times: pd.DataFrame, sweeps: pd.DataFrame,
    iterations: Mapping[str, int],
) -> pd.DataFrame:  # fmt: skip
    """One row for each full-order run, and for each reduced run with a time and an error.

    Velocities and energies are compared with the full-order run of the scene's own iterations.
    """
    times = results.timings_in_one_time(timings, frame_times)
    times = times[times.implementation == "compiled"]
    sweep = _sweep(sweeps, times)
    own = sweep[(sweep.method == FOM) & (sweep.iterations == sweep.scene.map(iterations))]
    known = results.trained(reruns).drop_duplicates("scene")[["scene", *results.OWN_ERRORS]]
    full = (own.assign(method="full"), sweep.assign(mesh_error=None))
    own, sweep = (each.merge(known, "left", "scene") for each in full)
    reduced = results.against_converged(reruns)
    points = results.trained(reduced).dropna(subset=_POINT)
    vertices = points.scene.map(times.groupby("scene").vertices.max())
    points = points.assign(iterations=points.scene.map(iterations), vertices=vertices)
    points = results.with_held_out(points.assign(mesh_error=None), reduced)
    parts = [part for part in (own, points, sweep) if len(part)]
    points = pd.concat(parts or [points], ignore_index=True).assign(reference=declaration.CONVERGED)
    for _, rows in points.groupby("scene", sort=False):
        points.loc[rows.index, "pareto"] = pareto(*rows[_POINT].to_numpy(float).T)
    order = {scene: place for place, scene in enumerate(iterations)}
    return points.sort_values("scene", key=lambda scene: scene.map(order), kind="stable")


def _sweep(errors: pd.DataFrame, times: pd.DataFrame) -> pd.DataFrame:
    """Rows of full-order runs with each number of iterations, on each mesh of the scene."""
    keys = ["scene", "method", "iterations", "vertices"]
    cost = times.fillna({"method": FOM})[[*keys, "ms_per_frame"]]
    most = errors.groupby("scene")[["mesh_error", "vertices"]].transform("max")
    coarser = errors.vertices < most.vertices
    names = np.where(coarser, COARSER, FOM), np.where(coarser, COARSER_ANDERSON, ANDERSON)
    method = np.where(errors.window > 0, names[1], names[0])
    errors = errors.assign(mesh_error=most.mesh_error, method=method)
    errors = errors.rename(columns={"error_converged": ERROR, "deformation_converged": DEFORMATION})
    points = errors.merge(cost, on=keys).dropna(subset=_POINT)
    return points.assign(position_basis="full", k=None, r=None)


# Columns that identify a curve (time of the local step over size r); its rows differ only in r.
CURVE = ["scene", "group", "method", "factor"]
SHARE = 1e-3  # table payoff omits groups with at most this share of all forces in a scene


@table(
    title="Reduced local steps against the full one, and where they stop paying",
    columns=(
        *shared("scene group method factor vertices elements r"),
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
    """One row per scene, group, method, mesh and size r: local-step times, and `break_even`."""
    # a factor of 1 would be the scene's own mesh again
    rows = results.joined([*own, *(file for file in sized if file["factor"] != "1")])
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

    The ratio of both times at each size ``r`` (ascending) is interpolated linearly after the last
    size with a ratio below one. Return None if that is the largest, the smallest if there is none.
    """
    sizes, values = np.asarray(r, dtype=float), np.asarray(ratio, dtype=float)
    below = np.flatnonzero(values < 1.0)
    if len(below) == 0:
        return int(sizes[0])
    if (last := below[-1]) == len(values) - 1:
        return None
    (a, b), (low, high) = sizes[last : last + 2], values[last : last + 2]
    return int(np.ceil(a + (b - a) * (1.0 - low) / (high - low) - 1e-9))


@table(
    title="Where reductions pay and where they lose to the full order",
    columns=(
        text(
            "measure", "errors that have to be within a limit: position, or both (deformation, too)"
        ),
        *shared("reference position_basis method"),
        count(
            "scenes", "scenes (and groups) with a timed run, whose reference is known well enough"
        ),
        count("accurate", "those with a run whose errors are at most a tenth"),
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
    `SHARE` of all forces in a scene are left out. The first rows are the full order with fewer
    iterations and on coarser meshes (from ``points``), which need no training. Motions whose
    converged run is not known well enough are left out.
    """
    weak = effects[effects.force_share <= SHARE].rename(columns={"effect": "group"})
    found = []
    for measure in results.MEASURES:
        judged = results.judged_by(results.against_converged(reruns), measure, FAILED)
        whole = results.judged_by(_full_order(points), measure, FAILED)
        found += [{"measure": measure, **row} for row in _summaries(judged, whole, weak)]
    return pd.DataFrame(found).assign(reference=declaration.CONVERGED)


def _summaries(
    reruns: pd.DataFrame, whole: pd.DataFrame, weak: pd.DataFrame
) -> Iterator[dict[str, object]]:
    """Yield a row for each method in ``whole`` and ``reruns``, without groups that are ``weak``."""
    runs = results.trained(reruns).dropna(subset=["speedup", "max_extent"])
    runs = runs[~results.among(runs, weak, EXPERIMENT)]
    runs = pd.concat([whole, results.with_held_out(runs, reruns)], ignore_index=True)
    for (basis, method), own in runs.groupby(["position_basis", "method"], sort=False):
        accurate = own[own[ERROR] <= FAILED]
        fastest = accurate.sort_values("speedup").groupby(EXPERIMENT).tail(1)
        speed, faster = fastest.speedup, fastest.speedup > 1.0
        best = own.sort_values(ERROR, kind="stable").groupby(EXPERIMENT).head(1)
        seen = best[best.error_heldout.notna()]
        # one run per scene and group, accurate or not: medians of all methods cover the same groups
        every = pd.concat([fastest, best[~(best[ERROR] <= FAILED)]])
        yield {
            "position_basis": basis,
            "method": method,
            "scenes": len(best),
            "accurate": len(fastest),
            "pays": int(faster.sum()),
            "loses": int((~faster).sum()),
            "best_speedup": speed.median(),
            "least_speedup": speed.min(),
            "most_speedup": speed.max(),
            "error_train": every[ERROR].fillna(np.inf).median(),
            "error_heldout": every.error_heldout.median(),
            "heldout": len(seen),
            "error_heldout_low": every.error_heldout_low.median(),
            "error_heldout_high": every.error_heldout_high.median(),
            "playback_error": every.playback_error.median(),
            "accurate_heldout": int((seen.error_heldout <= FAILED).sum()),
            "pays_heldout": int((faster & (fastest.error_heldout <= FAILED)).sum()),
        }


def _full_order(points: pd.DataFrame) -> pd.DataFrame:
    """Runs of ``points`` with fewer iterations or coarser meshes, and their speed-ups."""
    full = points[(points.method == "full") & (points.position_basis == "full")].set_index("scene")
    early = points.iterations < points.scene.map(full.iterations)
    fewer = points[(points.method == FOM) & early].assign(method="fewer-iterations")
    coarser = points[points.method.str.startswith(COARSER)].assign(method=COARSER)
    found = pd.concat([fewer, coarser])
    speedup = found.scene.map(full.ms_per_frame) / found.ms_per_frame
    return found.assign(group="all", speedup=speedup)
