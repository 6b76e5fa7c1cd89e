"""Tables of times: of effects, local steps and frames, on meshes of several sizes; speed-ups."""

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.reads import Setting, TableOf
from study.experiments.frame_times import CONTROL, FULL, REDUCED
from study.experiments.kit.base import FOM, GLOBAL, REST, RIGHT, Horizon, floor_of, horizons
from study.experiments.sensitivity import without
from study.tables.kit import declaration, results
from study.tables.kit.declaration import flag, integer, interval, number, shared, table, text, timed
from study.tables.kit.results import Rows, with_whole_sizes

KEYS = ["scene", "effect"]
NOTHING = "nothing"  # value of column effect in a row of a scene without any effect left out
PHASE, SEVERAL = "phase", "several"
IMPLEMENTATIONS = ("interpreted", "numpy", "compiled")


@table(
    title="Cost and contribution of each effect in a full-order run",
    columns=(
        *shared("scene"),
        text(
            "effect",
            "effect; phase of a frame (right-hand side, global solve, rest); or effects that are "
            f"left out together, {NOTHING} without any",
        ),
        text(
            "role",
            "constraint group, force, contact, hold or start; "
            f"{PHASE}: of a frame; {SEVERAL}: effects left out together",
        ),
        integer("elements", "number of elements of a group, of vertices of another effect"),
        *shared("ms_per_frame"),
        timed(number("share", "share of the frame time; shares of a scene add up to 1")),
        integer("groups", "number of constraint groups of the scene without this effect"),
        timed(number("without_ms", "frame time of the scene without this effect", "ms")),
        number("force", "root mean square over the frames of the norm of the force", "N"),
        number("force_share", "force over the sum of the forces of all effects of the scene"),
        number("energy", "range of the energy of the effect, if it has one", "J"),
        number("moved", "largest change of positions without the effect", compared="error"),
        *shared("sensitivity_floor"),
        flag("above_floor", "the change is larger than the sensitivity floor", compared="error"),
    ),
    reads={
        "costs": Rows(paths.EFFECTS),
        "left_out": Rows(paths.LEFT_OUT),
        "contributions": Rows(paths.CONTRIBUTIONS),
        "frame_times": TableOf("frame_times"),
        "sensitivity": TableOf("sensitivity"),
        "horizon": Setting("horizon"),
    },
)
def effects_cost(
    costs: pd.DataFrame, left_out: pd.DataFrame, contributions: pd.DataFrame,
    frame_times: pd.DataFrame, sensitivity: pd.DataFrame, horizon: Horizon,
) -> pd.DataFrame:  # fmt: skip
    """One row per effect or phase of a scene, then one per set of effects left out together.

    Column ``moved`` is empty for the only constraint group of a scene, as every run needs one.
    Times are scaled to those in ``frame_times`` (`in_one_time`).
    """
    own = costs.groupby("scene").ms_per_frame.sum()
    costs = results.in_one_time(costs, own, frame_times, columns=["ms_per_frame"])
    tables = [costs]
    if len(left_out):
        whole = left_out[left_out.left_out == NOTHING].set_index("scene").ms_per_frame
        times = ["ms_per_frame", "own_ms"]
        removed = results.in_one_time(left_out, whole, frame_times, columns=times)
        names = {"left_out": "effect", "ms_per_frame": "without_ms", "own_ms": "ms_per_frame"}
        removed = removed.rename(columns=names)
        tables.append(removed[~results.among(removed, costs, KEYS)].assign(role=SEVERAL))
        tables[0] = costs.merge(removed[[*KEYS, "groups", "without_ms"]], on=KEYS, how="left")
    if len(contributions):
        acting = _acting(contributions, sensitivity, horizon)
        tables[0] = tables[0].merge(acting, on=KEYS, how="left")
        tables.append(acting[~results.among(acting, costs, KEYS)])
    made = pd.concat(tables, ignore_index=True)
    order = made.groupby("scene", sort=False).ngroup().argsort(kind="stable")
    made = made.reindex(columns=effects_cost.column_names).iloc[order]
    return made.assign(role=made.role.mask(made.effect.isin([RIGHT, GLOBAL, REST]), PHASE))


def _acting(frames: pd.DataFrame, sensitivity: pd.DataFrame, horizon: Horizon) -> pd.DataFrame:
    """Per effect: RMS force, range of energy, largest change of positions if it is left out."""
    made = frames.groupby([*KEYS, "role"], sort=False, as_index=False).agg(
        force=("force", lambda force: float(np.sqrt(np.mean(np.square(force))))),
        energy=("energy", lambda of: float(of.max() - of.min() if len(of) > 1 else of.iloc[0])),
    )
    # Effects that set the start have a row for frame 0 only. Average their force over all frames.
    length = made.scene.map(frames.groupby("scene").frame.max() + 1)
    made.loc[made.role == "start", "force"] /= np.sqrt(length)
    made["force_share"] = made.force / made.groupby("scene").force.transform("sum")
    ends = horizons(sensitivity, horizon.perturbation, horizon.threshold)

    def largest(scene: str, label: float | str) -> float | None:
        """Largest difference before the horizon of run ``label`` to the original run, or None."""
        drift = floor_of(sensitivity, scene, label)[: ends[scene]]
        return float(drift.max()) if len(drift) else None

    made["sensitivity_floor"] = [largest(scene, horizon.perturbation) for scene in made.scene]
    made["moved"] = [largest(row.scene, without(row.effect)) for row in made.itertuples()]
    judged = made.moved.notna()
    made["above_floor"] = (made.moved > made.sensitivity_floor).where(judged, None).astype(object)
    return made


@table(
    title="Share of the local step in a full-order frame",
    columns=(
        *shared("scene"),
        text("implementation", f"code of the local step: {', '.join(IMPLEMENTATIONS)}"),
        *shared("vertices local_ms"),
        timed(number("assembly_ms", "time of the right-hand side in a frame", "ms")),
        *shared("global_ms local_share ms_per_frame"),
    ),
    reads={"timings": Rows(paths.TIMINGS), "frame_times": TableOf("frame_times")},
)
def local_share(timings: pd.DataFrame, frame_times: pd.DataFrame) -> pd.DataFrame:
    """One row per scene and implementation of the local step, with its share of the frame's time.

    The share includes the right-hand side, which compiled kernels compute with the projections.
    """
    times = results.timings_in_one_time(timings, frame_times)
    full = times[times.method.isna()]
    full = full.assign(local_share=(full.local_ms + full.assembly_ms) / full.ms_per_frame)
    order = {name: place for place, name in enumerate((*times.scene.unique(), *IMPLEMENTATIONS))}
    return full.sort_values(["scene", "implementation"], key=lambda names: names.map(order))


@table(
    title="Time of an iteration for different sizes of the mesh",
    columns=(
        *shared("scene"),
        text("method", f"{FOM} (full-order model), method of the reduced local step, or ecsw"),
        *shared("vertices"),
        integer("elements", "number of elements of all groups"),
        *shared("r k elements_sampled"),
        timed(number("ms_per_iteration", "time of an iteration", "ms")),
        timed(number("local_ms", "time of the local step; ecsw: of the whole iteration", "ms")),
        timed(number("global_ms", "time of the global solve in an iteration; ecsw: 0", "ms")),
        *shared("vertices_ms local_share speedup"),
        integer("meshes", "number of mesh sizes with this scene and method"),
        timed(number("exponent", "exponent of the power law of time over vertices")),
    ),
    reads={"rows": Rows(paths.SCALING)},
)
def scaling(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per scene, mesh size and method.

    The exponent is fitted in logarithms to all meshes of a scene and method, if there are at least
    three, because any two points fit a power law.
    """
    own = rows[rows.method == FOM].set_index(["scene", "vertices"])
    mesh = pd.MultiIndex.from_frame(rows[["scene", "vertices"]])
    speedup = own.ms_per_iteration.loc[mesh].to_numpy() / rows.ms_per_iteration
    meshes = rows.groupby(["scene", "method"]).vertices.transform("nunique")
    rows = rows.assign(speedup=speedup, meshes=meshes, exponent=np.nan)
    for _, curve in rows[meshes >= 3].groupby(["scene", "method"]):
        x, y = np.log(curve[["vertices", "ms_per_iteration"]].to_numpy(float)).T
        rows.loc[curve.index, "exponent"] = float(np.polyfit(x, y, 1)[0])
    return rows


_MODEL = ["scene", "position_basis", "k", "method"]
_REDUCTION = ["scene", "group", "method", "r"]
# As a control, the full-order run is timed twice. Speed-ups are not shown if the two times differ
# by more than this factor, which was fixed on 2026-11-22, before any control was measured.
CONFIRMED = 1.5
ENOUGH = 0.9  # share of a processor; with less, other programs have disturbed the times
UNCONFIRMED = "not confirmed by its control"
_ERRORS = {name: f"relative_{name}" for name in ("error_train", results.MEDIAN, results.HIGH)}
_TRAIN = {results.ERROR: "error_train", results.DEFORMATION: "deformation_train"}
_TIMES = ["ms_per_frame", "vertices_ms", "speedup", "speedup_low", "speedup_high"]


@table(
    title="Times of full-order frames, and of repeated timings as a control",
    columns=(
        *shared("scene vertices"),
        integer("processes", "number of processes that timed the run"),
        *shared("ms_per_frame"),
        *map(timed, interval("low_ms high_ms", unit="ms")),
        timed(number("control_ratio", "time of the same run timed again, over this time")),
        *map(timed, interval("control_low control_high")),
        timed(flag("control_agrees", "the interval of control_ratio contains 1")),
        timed(number("processor_share", "processor time over elapsed time of the process")),
        timed(number("twin_ratio", "time of the scene's short variant, same frames, over this")),
        *map(timed, interval("twin_low twin_high")),
    ),
    reads={"rows": Rows(paths.FRAME_TIMES)},
)
def frame_times(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per scene: medians over processes of full-order frame times and of their ratios."""
    full, control = (
        rows[rows.role == role].pivot(index="process", columns="scene", values="ms_per_frame")
        for role in (FULL, CONTROL)
    )
    made = []
    for scene, own in rows.groupby("scene", sort=False):
        values = {
            "ms_per_frame low_ms high_ms": full[scene],
            "control_ratio control_low control_high": control[scene] / full[scene],
        }
        if (twin := f"{scene}{results.TWIN}") in full:
            values["twin_ratio twin_low twin_high"] = full[twin] / full[scene]
        row = {"scene": scene, "vertices": own.vertices.iloc[0], "processes": len(full)}
        for names, ratios in values.items():
            row |= zip(names.split(), results.median_interval(ratios.to_numpy(float)), strict=True)
        row["control_agrees"] = row["control_low"] <= 1.0 <= row["control_high"]
        made.append(row | {"processor_share": own.processor_share.median()})
    return pd.DataFrame(made).reindex(columns=frame_times.column_names)


@table(
    title="Speed-ups measured in several processes, with training times and errors",
    columns=(
        *shared("scene vertices group method position_basis k r"),
        integer("processes", "number of processes that timed the run"),
        timed(number("full_ms", "time of a full-order frame", "ms")),
        *shared("ms_per_frame vertices_ms speedup speedup_low speedup_high"),
        timed(text("shown", "median speed-up with its interval, if the control confirms it")),
        timed(flag("loses", "slower than the full-order run: the upper quantile is below 1")),
        timed(number("training_s", "time of the training run", "s")),
        timed(number("reduction_s", "processor time of basis and sampling", "s")),
        timed(number("frames_to_break_even", "frames that save both these times; empty: never")),
        *shared("reference"),
        number("error_train", "training error up to the horizon (large scenes: all frames)"),
        number("deformation_train", "deformation error in these frames"),
        *results.COLUMNS,
    ),
    reads={
        "measured": Rows(paths.FRAME_TIMES),
        "times": TableOf("frame_times"),
        "projections": Rows(paths.PROJECTION_SECONDS),
        "subspaces": Rows(paths.SUBSPACES_SECONDS),
        "large": Rows(paths.ONLINE),
        "reruns": TableOf("reduced_reruns"),
    },
)
def speedups(
    measured: pd.DataFrame, times: pd.DataFrame, projections: pd.DataFrame,
    subspaces: pd.DataFrame, large: pd.DataFrame, reruns: pd.DataFrame,
) -> pd.DataFrame:  # fmt: skip
    """One row per timed reduction; speed-ups compare runs of the same process."""
    made = timed_reductions(measured, times)
    if made.empty:
        return made
    inside, small = made.position_basis != "full", results.against_converged(reruns)
    seconds, errors = [subspaces], [_errors(small, _MODEL)]
    if len(large):
        seconds.append(results.trained(large))
        errors.append(large_errors(large))
    parts = [
        _with_costs(made[~inside], _REDUCTION, [projections], [_errors(small, _REDUCTION)]),
        _with_costs(made[inside], _MODEL, seconds, errors),
    ]
    made = pd.concat([part for part in parts if len(part)]).sort_index()
    of_large = ~made.scene.isin(reruns.scene)
    made["reference"] = of_large.map({True: declaration.ITERATIONS, False: declaration.CONVERGED})
    made["training_s"] = 1e-3 * made.full_ms * made.frames
    saved = made.full_ms - made.ms_per_frame
    paid = 1e3 * (made.training_s + made.reduction_s) / saved
    return made.assign(frames_to_break_even=paid.where(saved > 0.0))


def _with_costs(
    made: pd.DataFrame, keys: list[str], seconds: list[pd.DataFrame], errors: list[pd.DataFrame]
) -> pd.DataFrame:
    """Return ``made`` with ``reduction_s`` and errors of the rows with the same ``keys``."""
    found = made.reset_index()
    for source in (pd.concat(seconds).reindex(columns=[*keys, "reduction_s"]), pd.concat(errors)):
        typed = source if len(source) else source.astype(object)
        found = with_whole_sizes(found).merge(with_whole_sizes(typed), on=keys, how="left")
    return found.set_index("index")


def timed_reductions(measured: pd.DataFrame, times: pd.DataFrame) -> pd.DataFrame:
    """One row for each reduction in ``measured``, whose rows have its time in each process."""
    rows = measured.set_index(["scene", "process"])
    full, reduced = rows[rows.role == FULL].ms_per_frame, rows[rows.role == REDUCED]
    trusted = confirmed(times.set_index("scene"))
    made = []
    for labels, own in reduced.groupby(results.KEYS, sort=False, dropna=False):
        before = full.loc[own.index]
        ratio, low, high = results.median_interval((before / own.ms_per_frame).to_numpy(float))
        shown = results.in_words(ratio, low, high) if trusted[labels[0]] else UNCONFIRMED
        made.append({
            **dict(zip(results.KEYS, labels, strict=True)),
            "vertices": own.vertices.iloc[0], "frames": own.frames.iloc[0], "processes": len(own),
            "full_ms": before.median(), "ms_per_frame": own.ms_per_frame.median(),
            "vertices_ms": own.vertices_ms.median(), "speedup": ratio, "speedup_low": low,
            "speedup_high": high, "shown": shown, "loses": high < 1.0,
        })  # fmt: skip
    return pd.DataFrame(made)


def confirmed(times: pd.DataFrame) -> pd.Series:
    """Whether the control of each scene in table frame_times (``times``) confirms its times."""
    return (times.control_low >= 1.0 / CONFIRMED) & (times.control_high <= CONFIRMED)


def unreliable(times: pd.DataFrame) -> bool:
    """Return whether the table frame_times (``times``) has times that cannot be trusted.

    Its processes had less than `ENOUGH` of a processor, or most controls do not confirm the times.
    """
    enough = times.processor_share.median() >= ENOUGH and confirmed(times).mean() >= 0.5
    return len(times) > 0 and not enough


def _errors(reruns: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    runs = reruns[(reruns.position_basis != "full") == (keys == _MODEL)]
    train = results.trained(runs)[[*keys, *_TRAIN]].rename(columns=_TRAIN)
    return with_whole_sizes(train).merge(results.over_motions(runs, keys), on=keys, how="outer")


def large_errors(large: pd.DataFrame) -> pd.DataFrame:
    """Errors over all frames, per model: in training; median and range on test trajectories."""
    whole = large.rename(columns={"relative_error": results.ERROR}).assign(horizon_frame=1)
    return _errors(whole, _MODEL)


@table(
    title="Large scenes: reduced positions with sampled elements",
    columns=(
        *shared("scene vertices"),
        integer("elements", "number of elements of all groups"),
        *shared("position_basis k"),
        number("tau", "tolerance of the element sampling", compared="exact"),
        *shared("elements_sampled training_residual reference"),
        number("relative_error_train", "position error, training trajectory"),
        number("deformation_train", "deformation error on the training trajectory"),
        number("relative_error_heldout", "median position error on test trajectories"),
        number("relative_error_heldout_high", "largest position error on test trajectories"),
        *results.COLUMNS[3:],
        *shared("ms_per_frame vertices_ms"),
        timed(number("ms_per_iteration", "time of an iteration", "ms")),
        *shared("speedup speedup_low speedup_high"),
    ),
    reads={
        "rows": Rows(paths.ONLINE),
        "measured": Rows(paths.FRAME_TIMES),
        "times": TableOf("frame_times"),
    },
)
def online(rows: pd.DataFrame, measured: pd.DataFrame, times: pd.DataFrame) -> pd.DataFrame:
    """One row per model of a large scene: errors in ``rows``, times in ``measured``, ``times``."""
    made = results.trained(rows).rename(columns={"r": "elements_sampled"})
    made = made.assign(reference=declaration.ITERATIONS)
    made = made.drop(columns="playback_error")  # zero, as the training run is replayed exactly
    found = timed_reductions(measured, times)[[*_MODEL, *_TIMES]]
    for source in (large_errors(rows).rename(columns=_ERRORS), found):
        made = with_whole_sizes(made).merge(with_whole_sizes(source), on=_MODEL, how="left")
    return made.assign(ms_per_iteration=made.ms_per_frame / made.iterations)
