"""Tables of error and time of each method and size, and of reductions that save time.

Errors are taken against the run with converged frames (K -> infinity local-global iterations).
Method ``full`` with full positions is the full-order run with the scene's K, ``fom`` that with
another K, ``fom-anderson`` that with Anderson acceleration; ``coarser-mesh`` and
``coarser-mesh-anderson`` are the last two on a coarser mesh.
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
    title="Error and frame time of every method and size",
    only_with_error=True,
    columns=(
        *shared("scene group method position_basis k r"),
        integer("iterations", "local-global iterations of a frame"),
        integer("vertices", "number of vertices of the simulated mesh"),
        *shared("relative_error_within_horizon deformation_error ms_per_frame"),
        timed(flag("pareto", "no row of the scene is as good in error and time and better in one")),
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

    Velocities and energies are compared with the full-order run with the scene's iterations.
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


# Columns that identify a curve (time of the local step over size r); rows of a curve differ in r.
CURVE = ["scene", "group", "method", "factor"]
SHARE = 1e-3  # table payoff omits groups with at most this share of the forces in a scene


@table(
    title="Reduced local steps: times, and the size from which they are slower than the full step",
    columns=(
        *shared("scene group method factor vertices elements r"),
        timed(number("local_ms", "time of the reduced local step", "ms")),
        timed(number("full_ms", "time of the full local step of this group", "ms")),
        timed(number("ratio", "reduced time over full time")),
        timed(integer("breakeven_r", "size r from which the reduced local step is slower")),
        timed(number("solve_ratio", "time of the solve over that of the full local step")),
        timed(number("lift_ratio", "time of the reconstruction over full time")),
    ),
    reads={"own": Every(paths.BREAK_EVEN), "sized": Every(paths.BREAK_EVEN_SIZED)},
)
def breakeven(own: list[paths.File], sized: list[paths.File]) -> pd.DataFrame:
    """One row per scene, group, method, mesh and size r: local-step times, and `break_even`."""
    # Files with a factor of 1 repeat the scene's mesh.
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

    ``ratio``, the ratio of these times at each size ``r`` (ascending), is interpolated after the
    last size with a ratio below 1. Return None if this is the last size, the first if none is.
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
    title="Reductions that are faster than the full-order model, and those that are slower",
    columns=(
        text(
            "measure", "errors that must be within the limit: position, or both (deformation, too)"
        ),
        *shared("reference position_basis method"),
        count("scenes", "cases: scenes and groups with a timed run and an accurate reference"),
        count("accurate", "cases with a run whose errors are at most 10 %"),
        timed(integer("pays", "cases with an accurate run that is faster than the full-order run")),
        timed(integer("loses", "cases whose accurate runs are all slower")),
        timed(number("best_speedup", "median speed-up of the fastest accurate runs")),
        timed(number("least_speedup", "smallest speed-up of these runs")),
        timed(number("most_speedup", "largest speed-up of these runs")),
        timed(number("error_train", "median error over cases: fastest accurate run, or best one")),
        timed(number("error_heldout", "median error of these runs on test trajectories")),
        integer("heldout", "cases with a test trajectory"),
        timed(number("error_heldout_low", "median over runs of the least error in a test")),
        timed(number("error_heldout_high", "median over runs of the largest error in a test")),
        *shared("playback_error"),
        count("accurate_heldout", "cases whose most accurate size has at most 10 % error in tests"),
        timed(integer("pays_heldout", "faster cases whose run has at most 10 % error in tests")),
    ),
    reads={
        "reruns": TableOf("reduced_reruns"),
        "points": TableOf("accuracy_cost"),
        "effects": TableOf("effects_cost"),
    },
)
def payoff(reruns: pd.DataFrame, points: pd.DataFrame, effects: pd.DataFrame) -> pd.DataFrame:
    """One row per position basis and method, which summarises its timed runs of all scenes.

    For each scene and group, a size is chosen on the training trajectory (that of the fastest
    accurate run, or else of the most accurate run) and evaluated on test trajectories. The first
    rows are full-order runs with fewer iterations and on coarser meshes (from ``points``), which
    need no training. Groups with at most `SHARE` of the forces in a scene are left out, and
    trajectories without an accurate reference.
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
        # One run per scene and group, accurate or not, so that all medians cover the same groups.
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
