"""Tables of times over several processes: full-order frames, speed-ups, and large scenes."""

from collections.abc import Iterator

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, TableOf
from study.experiments.frame_times import CONTROL, FULL, REDUCED
from study.tables.kit import results
from study.tables.kit.declaration import flag, integer, number, shared, table, text, timed

_MODEL = ["scene", "position_basis", "k", "method"]
_REDUCTION = ["scene", "group", "method", "r"]
_LABELS = ["scene", "group", "method", "position_basis", "k", "r"]
_ERROR = "relative_error_within_horizon"
# The control times the full-order run a second time. If both times differ by more than this factor,
# speed-ups are not shown. Fixed on 2026-11-22, before any control had been measured.
CONFIRMED = 1.5
UNCONFIRMED = "not confirmed by its control"
_ERRORS = {
    "error_train": "relative_error_train", results.MEDIAN: "relative_error_heldout",
    results.LOW: "relative_error_heldout_low", results.HIGH: "relative_error_heldout_high",
}  # fmt: skip
_TIMES = [
    "ms_per_frame", "vertices_ms", "fom_ms_per_frame", "speedup", "speedup_low", "speedup_high",
]  # fmt: skip


@table(
    title="Times of full-order frames, with their controls",
    columns=(
        *shared("scene vertices"),
        integer("processes", "processes that timed it"),
        *shared("ms_per_frame"),
        timed(number("low_ms", "2.5 % quantile of this median (bootstrap)", "ms")),
        timed(number("high_ms", "97.5 % quantile", "ms")),
        timed(number("control_ratio", "time of the same run, timed once more, over this one")),
        timed(number("control_low", "2.5 % quantile of this median")),
        timed(number("control_high", "97.5 % quantile")),
        timed(flag("control_agrees", "the quantiles enclose one")),
        timed(number("twin_ratio", "time of the scene's twin, the same frames, over this one")),
        timed(number("twin_low", "2.5 % quantile of this median")),
        timed(number("twin_high", "97.5 % quantile")),
        timed(flag("confirmed", "the quantiles lie within a half of one: speed-ups are given")),
    ),
    reads={"parts": Every(paths.FRAME_TIMES)},
)
def frame_times(parts: list[File]) -> pd.DataFrame:
    """One row per scene in ``parts``: medians over processes, ratios within a process."""
    rows = results.joined(parts)
    if rows.empty:
        return rows
    full, control = (
        rows[rows.role == role].pivot(index="process", columns="scene", values="ms_per_frame")
        for role in (FULL, CONTROL)
    )
    vertices = rows.groupby("scene").vertices.first()
    made = []
    for scene in rows.scene.unique():
        values = {
            ("ms_per_frame", "low_ms", "high_ms"): full[scene],
            ("control_ratio", "control_low", "control_high"): control[scene] / full[scene],
        }
        if f"{scene}{results.TWIN}" in full:
            twin = full[f"{scene}{results.TWIN}"] / full[scene]
            values["twin_ratio", "twin_low", "twin_high"] = twin
        row = {"scene": scene, "vertices": vertices[scene], "processes": len(full)}
        for names, measured in values.items():
            row |= zip(names, results.median_interval(measured.to_numpy(float)), strict=True)
        low, high = row["control_low"], row["control_high"]
        row["confirmed"] = low >= 1.0 / CONFIRMED and high <= CONFIRMED
        row["control_agrees"] = low <= 1.0 <= high
        made.append(row)
    return pd.DataFrame(made).reindex(columns=frame_times.column_names)


@table(
    title="Speed-ups over several processes, with what they cost",
    columns=(
        *shared("scene vertices group method position_basis k r"),
        integer("processes", "processes that timed it"),
        timed(number("full_ms", "time of a frame of the full-order run", "ms")),
        *shared("ms_per_frame vertices_ms speedup speedup_low speedup_high"),
        timed(text("shown", "the median and its quantiles, where the control confirms the times")),
        timed(flag("loses", "dearer than the full order: the upper quantile is below one")),
        timed(number("training_s", "time of the training run", "s")),
        timed(number("reduction_s", "processor time of basis and sampling", "s")),
        timed(
            number("frames_to_break_even", "frames after which both are paid back; none if never")
        ),
        number(
            "error_train", "of the training motion before the horizon, over all of a large scene"
        ),
        *results.COLUMNS,
    ),
    reads={
        "parts": Every(paths.FRAME_TIMES),
        "times": TableOf("frame_times"),
        "projections": Every(paths.PROJECTION_SECONDS),
        "subspaces": Every(paths.SUBSPACES_SECONDS),
        "large": Every(paths.ONLINE),
        "reruns": TableOf("reduced_reruns"),
    },
)
def speedups(times: pd.DataFrame, reruns: pd.DataFrame, **files: list[File]) -> pd.DataFrame:
    """One row per reduction timed in ``parts``; each speed-up is a ratio within one process."""
    rows = results.joined(files["parts"])
    if rows.empty or not (rows.role == REDUCED).any():
        return pd.DataFrame()
    made = pd.DataFrame(list(timed_reductions(rows, times)))
    extra = [
        results.joined(files["projections"]).reindex(columns=[*_REDUCTION, "reduction_s"]),
        results.joined(files["subspaces"]).reindex(columns=[*_MODEL, "reduction_s"]),
    ]
    errors = [_errors(reruns, keys) for keys in (_REDUCTION, _MODEL)]
    own = results.joined(files["large"])
    if len(own):
        extra.append(own[own.motion == results.TRAIN].reindex(columns=[*_MODEL, "reduction_s"]))
        errors.append(large_errors(own))
    made = _first_known(made, extra, "reduction_s")
    for column in ("error_train", *(column.name for column in results.COLUMNS)):
        made = _first_known(made, errors, column)
    made["training_s"] = 1e-3 * made.full_ms * made.frames
    saved = made.full_ms - made.ms_per_frame
    paid = 1e3 * (made.training_s + made.reduction_s) / saved
    return made.assign(frames_to_break_even=paid.where(saved > 0.0))


def timed_reductions(rows: pd.DataFrame, times: pd.DataFrame) -> Iterator[dict]:
    """Labels, median times and speed-up of each reduction over the processes, as dictionaries.

    Parameters
    ----------
    rows : times measured in each process, with the role of the run (full order or reduced)
    times : table frame_times
    """
    full = rows[rows.role == FULL].set_index(["scene", "process"]).ms_per_frame
    trusted = times.set_index("scene").confirmed
    reduced = rows[rows.role == REDUCED]
    for labels, own in reduced.groupby(_LABELS, sort=False, dropna=False):
        own = own.set_index(["scene", "process"])
        vertices_ms, own = float(own.vertices_ms.median()), own.ms_per_frame
        ratio, low, high = results.median_interval((full.loc[own.index] / own).to_numpy(float))
        scene = labels[0]
        first = rows[rows.scene == scene].iloc[0]
        yield {
            **dict(zip(_LABELS, labels, strict=True)),
            "vertices": first.vertices,
            "frames": first.frames,
            "processes": len(own),
            "full_ms": float(full.loc[own.index].median()),
            "ms_per_frame": float(own.median()),
            "vertices_ms": vertices_ms,
            "speedup": ratio,
            "speedup_low": low,
            "speedup_high": high,
            "shown": results.in_words(ratio, low, high) if trusted[scene] else UNCONFIRMED,
            "loses": high < 1.0,
        }


def _errors(reruns: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    runs = reruns[(reruns.position_basis != "full") == (keys == _MODEL)]
    train = results.trained(runs)[[*keys, _ERROR]].rename(columns={_ERROR: "error_train"})
    sizes = {key: "Int64" for key in keys if key in ("k", "r")}
    return train.astype(sizes).merge(results.over_motions(runs, keys), on=keys, how="outer")


def large_errors(large: pd.DataFrame) -> pd.DataFrame:
    """Errors of each model of large scenes over whole runs, from the rows of all motions."""
    whole = large.rename(columns={"relative_error": _ERROR}).assign(horizon_frame=1)
    return _errors(whole, _MODEL)


def _first_known(made: pd.DataFrame, sources: list[pd.DataFrame], column: str) -> pd.DataFrame:
    """``made`` with ``column`` filled from the first of ``sources`` that has the row's value."""
    found = pd.Series(float("nan"), made.index)
    for source in sources:
        keys = [key for key in _LABELS if key in source.columns]
        sizes = {key: "Int64" for key in keys if key in ("k", "r")}
        known = source.dropna(subset=[*keys, column])[[*keys, column]].astype(sizes)
        own = made[keys].astype(sizes).merge(known, on=keys, how="left")[column]
        found = found.fillna(own.astype(float).set_axis(made.index))
    return made.assign(**{column: found})


@table(
    title="Large scenes in position subspaces with sampled elements",
    columns=(
        *shared("scene vertices"),
        integer("elements", "elements of all groups"),
        *shared("position_basis k"),
        number("tau", "tolerance of the element sampling", compared="exact"),
        *shared("elements_sampled"),
        number("relative_error_train", "error of the positions in the training motion"),
        number("relative_error_heldout", "the same in held-out motions: their median"),
        number("relative_error_heldout_low", "the least of them"),
        number("relative_error_heldout_high", "the largest"),
        *results.COLUMNS[3:],
        *shared("ms_per_frame vertices_ms"),
        timed(number("ms_per_iteration", "time of an iteration", "ms")),
        timed(number("fom_ms_per_frame", "time of a frame of the full-order run", "ms")),
        *shared("speedup speedup_low speedup_high"),
    ),
    reads={
        "parts": Every(paths.ONLINE),
        "measured": Every(paths.FRAME_TIMES),
        "times": TableOf("frame_times"),
    },
)
def online(parts: list[File], measured: list[File], times: pd.DataFrame) -> pd.DataFrame:
    """One row per model of large scenes (files ``parts``), with errors and ``measured`` times."""
    rows = results.joined(parts)
    if rows.empty:
        return rows
    found = pd.DataFrame(list(timed_reductions(results.joined(measured), times)))
    found = found.rename(columns={"full_ms": "fom_ms_per_frame"})
    made = rows[rows.motion == results.TRAIN].rename(columns={"r": "elements_sampled"})
    made = made.drop(columns="playback_error")  # of the training motion itself
    made = made.merge(large_errors(rows).rename(columns=_ERRORS), on=_MODEL, how="left")
    made = made.merge(found[[*_MODEL, *_TIMES]], on=_MODEL, how="left")
    return made.assign(ms_per_iteration=made.ms_per_frame / made.iterations)
