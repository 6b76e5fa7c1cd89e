"""Tables of reduced runs: errors, times and outcomes, also in scenes with extreme settings."""

from collections.abc import Mapping, Sequence
from typing import Any

import h5py
import numpy as np
import pandas as pd

from pdrom.core.store import open_hdf5, read_table
from pdrom.model.held_out import MOTIONS, PLAYBACK
from pdrom.reduction import deviations
from pdrom.reduction.deviations import DEVIATIONS, ERRORS, Series, errors_within
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting, TableOf
from study.experiments.kit.base import TRAIN, Horizon, floor_of, horizons
from study.tables.kit import declaration, results
from study.tables.kit.declaration import flag, number, shared, table, text
from study.tables.kit.results import Rows


@table(
    title="Reduced runs on training and test trajectories",
    columns=(
        *shared("scene group method position_basis k r frames finite blowup_frame max_extent"),
        *shared("training_residual relative_error relative_error_within_horizon"),
        *shared("deformation_error playback_error reference error_converged deformation_converged"),
        *shared("reference_error reference_deformation_error horizon_frame sensitivity_floor"),
        *shared("ms_per_frame vertices_ms local_ms global_ms speedup"),
        *shared("error_over_extent shape_error velocity_error energy_drift"),
        text(
            "motion",
            f"trajectory: {TRAIN}, or a test trajectory, one of: {', '.join(MOTIONS)}",
        ),
    ),
    reads={
        "references": Rows(paths.REFERENCES),
        "runs": Every(paths.RERUNS),
        "rows": Every(paths.RERUNS_TRAIN),
        "rows_heldout": Every(paths.RERUNS_HELDOUT),
        "subspaces": Every(paths.SUBSPACES),
        "subspace_rows": Every(paths.SUBSPACES_TRAIN),
        "subspace_rows_heldout": Every(paths.SUBSPACES_HELDOUT),
        "timings": Rows(paths.TIMINGS),
        "frame_times": TableOf("frame_times"),
        "sensitivity": TableOf("sensitivity"),
        "horizon": Setting("horizon"),
    },
)
def reduced_reruns(
    references: pd.DataFrame, timings: pd.DataFrame, frame_times: pd.DataFrame,
    sensitivity: pd.DataFrame, horizon: Horizon, **files: list[File],
) -> pd.DataFrame:  # fmt: skip
    """Reduced runs on the training trajectory with their times, then on each test trajectory.

    Runs with reduced positions follow runs with reduced groups. The horizon of a trajectory is the
    first frame in which perturbed full-order runs differ from the unperturbed run by more than a
    limit. Errors "within the horizon" use earlier frames only and are empty if a run blew up in
    these. Rows of method `PLAYBACK` compare the training trajectory with a test trajectory.
    """
    judged: list[pd.DataFrame] = []
    for motion in (TRAIN, *MOTIONS):
        label = horizon.perturbation if motion == TRAIN else motion
        ends = horizons(sensitivity, label, horizon.threshold)
        kind = "" if motion == TRAIN else "_heldout"
        tables = files[f"rows{kind}"] + files[f"subspace_rows{kind}"]
        both = zip(files["runs"] + files["subspaces"], tables, strict=True)
        parts = [_judged(run, row, ends[run["scene"]], motion) for run, row in both]
        found = pd.concat(parts, ignore_index=True).assign(motion=motion)
        floor = {
            scene: float(floor_of(sensitivity, scene, label)[:end].max(initial=0.0))
            for scene, end in ends.items()
        }
        found["horizon_frame"] = found.scene.map(ends)
        found["sensitivity_floor"] = found.scene.map(floor)
        if motion != TRAIN:
            played = _played(references, motion)
            found["playback_error"] = found.scene.map(played.set_index("scene").playback_error)
            found = pd.concat([found, played], ignore_index=True)
        judged.append(found)
    judged[0] = _with_times(judged[0], results.timings_in_one_time(timings, frame_times))
    made = pd.concat(judged, ignore_index=True).assign(reference=declaration.ITERATIONS)
    known = references[["scene", "motion", *results.OWN_ERRORS]]
    return made.merge(known, on=["scene", "motion"], how="left")


def _played(references: pd.DataFrame, motion: str) -> pd.DataFrame:
    """Errors, a row per scene, if the training trajectory is replayed instead of ``motion``."""
    rows = references[references.motion == motion]
    return pd.DataFrame({
        "scene": rows.scene, "group": "all", "method": PLAYBACK, "position_basis": "full",
        "frames": rows.frames, "finite": True, "motion": motion,
        "horizon_frame": rows.horizon_frame, "relative_error": rows.playback_all,
        "playback_error": rows.playback_error, results.ERROR: rows.playback_error,
        results.DEFORMATION: rows.playback_deformation_error, "error_converged": rows.replay_error,
        "deformation_converged": rows.replay_deformation_error,
    })  # fmt: skip


def _judged(run: File, row: File, end: int, motion: str) -> pd.DataFrame:
    """Rows of file ``row`` for ``motion``, with errors before frame ``end`` from file ``run``."""
    table = read_table(row.path)
    if motion != TRAIN:  # tables of training runs have no column "motion"
        table = table[table.motion == motion]
    with open_hdf5(run.path) as file:
        if "group" in run.labels:
            table = table.assign(position_basis="full", k=None, training_residual=None)
            store = file if motion == TRAIN else file[motion]
            runs = [store[f"r{r:04d}"] for r in table.r]
            reference = {series: store[series][...] for series in deviations.REFERENCE}
        else:
            models = [f"{t.position_basis}_k{t.k:03d}_{t.method}" for t in table.itertuples()]
            runs = [file[f"models/{model}/{motion}"] for model in models]
            reference = {series: file[f"{series}/{motion}"][...] for series in deviations.REFERENCE}
        return table.assign(**_errors(runs, reference, end, file.attrs))


def _errors(
    runs: Sequence[h5py.Group], reference: Series, end: int, units: Mapping[str, Any]
) -> dict[str, list[float | None]]:
    """Name of an error -> its values before frame ``end``, one per run; None if it blew up."""
    known = {unit: float(units[unit]) for unit in ("extent_norm", "rest_norm")}
    found = [
        errors_within({series: run[series][...] for series in DEVIATIONS}, reference, end, **known)
        if "difference" in run
        else dict.fromkeys(ERRORS)
        for run in runs
    ]
    return {name: [errors[name] for errors in found] for name in ERRORS}


def _with_times(runs: pd.DataFrame, times: pd.DataFrame) -> pd.DataFrame:
    """Return ``runs`` with columns of times and speed-ups over the compiled full-order run."""
    full = times[times.method.isna() & (times.implementation == "compiled")]
    reduced = times[times.method.notna()].fillna({"position_basis": "full"})
    reduced["local_ms"] += reduced.assembly_ms + reduced.lift_ms
    own = reduced.scene.map(full.set_index("scene").ms_per_frame)
    reduced["speedup"] = own / reduced.ms_per_frame
    # Rows of subspace models are matched by k, because their r is the number of sampled elements.
    for rows in (runs, reduced):
        rows["size"] = rows.r.where(rows.position_basis == "full", rows.k).astype(float)
    keys = ["scene", "group", "method", "position_basis", "size"]
    measured = ["ms_per_frame", "vertices_ms", "local_ms", "global_ms", "speedup"]
    return runs.merge(reduced[keys + measured], on=keys, how="left")


OUTCOMES = ("accurate", "wrong", "left the scene", "blow-up", "not run", "not judged")
SETTING = ["experiment", "scene", "h", "stiffness_ratio"]  # columns that identify a full-order run
# Fraction of runs on degenerate meshes whose outcome may differ because of rounding errors.
FRAGILE = 0.005


@table(
    title="Outcome of every reduced simulation",
    columns=(
        *shared("scene method r"),
        number("h", "time step", "s", compared="exact"),
        number("stiffness_ratio", "factor on the weights of the reduced groups", compared="exact"),
        *shared("finite blowup_frame max_extent energy_ratio gain group position_basis k"),
        text("experiment", "rerun (run of the study) or sweep (short run)"),
        *shared("reference"),
        number("relative_error", "position error: rerun before the horizon, sweep in all frames"),
        text("outcome", f"one of: {', '.join(OUTCOMES)}", compared="error"),
    ),
    reads={
        "full_order": Every(paths.TRAIN),
        "reruns": Rows(paths.RERUNS_TRAIN),
        "subspaces": Rows(paths.SUBSPACES_TRAIN),
        "sweeps": Rows(paths.STABILITY),
        "reduced_reruns": TableOf("reduced_reruns"),
        "time_steps": Setting("scene_time_steps"),
        "wrong": Setting("stability.wrong"),
        "departure": Setting("stability.left"),
    },
)
def stability(
    full_order: list[File], reruns: pd.DataFrame, subspaces: pd.DataFrame, sweeps: pd.DataFrame,
    reduced_reruns: pd.DataFrame, time_steps: Mapping[str, float], wrong: float, departure: float,
) -> pd.DataFrame:  # fmt: skip
    """Outcomes of reduced runs ("rerun"), then of short runs with other h or stiffness ("sweep").

    The error of a "rerun" row is taken before the horizon, that of a "sweep" row over all frames.
    """
    runs = pd.concat([reruns.assign(position_basis="full", k=np.nan), subspaces], ignore_index=True)
    errors = results.trained(reduced_reruns)[[*results.KEYS, results.ERROR]]
    errors = errors.rename(columns={results.ERROR: "relative_error"})
    runs = runs.drop(columns="relative_error")
    runs = runs.merge(errors, on=results.KEYS, how="left", validate="one_to_one")
    runs = pd.concat([_full_order_rows(full_order), runs], ignore_index=True)
    runs = runs.assign(h=runs.scene.map(time_steps), stiffness_ratio=1.0, experiment="rerun")
    rows = pd.concat([runs, sweeps.assign(experiment="sweep")], ignore_index=True)
    return rows.assign(outcome=outcomes(rows, wrong, departure), reference=declaration.ITERATIONS)


def outcomes(runs: pd.DataFrame, wrong: float, departure: float) -> list[str]:
    """Outcome of each run, one of `OUTCOMES`.

    It is the first that fits: "not run", "blow-up", "left the scene" if the extent (longest side of
    the bounding box) exceeds ``departure`` times the full-order run's, "not judged" if there is no
    error, "wrong" if the error exceeds ``wrong``, and else "accurate".
    """
    full = runs[(runs.method == "full") & (runs.position_basis == "full")]
    extents = full.set_index(SETTING).max_extent.rename("full_extent")
    error = runs.relative_error.astype(float)
    classes = {
        "not run": runs.finite.isna(),
        "blow-up": runs.finite.astype(float) == 0.0,
        "left the scene": runs.max_extent > departure * runs.join(extents, on=SETTING).full_extent,
        "not judged": error.isna(),
        "wrong": error > wrong,
    }
    return np.select(list(classes.values()), list(classes), "accurate").tolist()


def _full_order_rows(files: list[File]) -> pd.DataFrame:
    """Rows of the full-order runs in ``files``; their energy ratio is 1, their error 0."""
    rows = []
    for run in files:
        with open_hdf5(run.path) as file:
            extents = np.ptp(file["positions"][...], axis=1).max(axis=1)
        ends = {"finite": np.isfinite(extents).all(), "max_extent": extents[1:].max() / extents[0]}
        rows.append({"scene": run["scene"], **ends})
    names = {"method": "full", "position_basis": "full"}
    return pd.DataFrame(rows).assign(**names, energy_ratio=1.0, relative_error=0.0)


@table(
    title="Outcome of every reduction in every hard case",
    columns=(
        text("case", "name of the hard case"),
        *shared("method"),
        flag("bounded_projections", "projections of the reduced group are bounded in every state"),
        *shared("k r gain frames"),
        flag("finite", "no frame of the run blew up", compared="error", tolerance=FRAGILE),
        *shared("blowup_frame"),
        number("max_extent", "largest extent over that of the full-order run", compared="error"),
        text("outcome", "outcome of the reduced run", compared="error", tolerance=FRAGILE),
        text("why", "reason of a refusal or a failure", compared="error", tolerance=FRAGILE),
    ),
    reads={"rows": Rows(paths.HARD_CASES)},
)
def hard_cases(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the ``rows`` of all cases: scenes with extreme meshes, states or settings."""
    return rows
