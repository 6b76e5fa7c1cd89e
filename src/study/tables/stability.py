"""Tables of where each method fails: over scenes, sizes, time step, stiffness, and hard cases."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from pdrom.core.store import open_hdf5
from study.artifact import paths
from study.artifact.reads import Every, Setting, TableOf
from study.tables.kit.declaration import flag, number, shared, table, text
from study.tables.kit.results import KEYS, joined, trained

# only after the first outcome are further results of a run used
OUTCOMES = ("accurate", "wrong", "left the scene", "blow-up", "not run", "not judged")
SETTING = ["experiment", "scene", "h", "stiffness_ratio"]  # columns that identify a full-order run
# Share of the runs on degenerate meshes whose outcome may differ between machines by rounding.
FRAGILE = 0.005


@table(
    title="Where each method can be trusted",
    columns=(
        *shared("scene method r"),
        number("h", "time step", "s", compared="exact"),
        number("stiffness_ratio", "factor on the weights of the reduced groups", compared="exact"),
        *shared("finite blowup_frame max_extent energy_ratio gain group position_basis k"),
        text("experiment", "rerun (of the study) or sweep (a short run)"),
        *shared("relative_error"),
        text("outcome", f"one of: {', '.join(OUTCOMES)}", compared="error"),
    ),
    reads={
        "full_order": Every(paths.TRAIN),
        "reruns": Every(paths.RERUNS_TRAIN),
        "subspaces": Every(paths.SUBSPACES_TRAIN),
        "sweeps": Every(paths.STABILITY),
        "reduced_reruns": TableOf("reduced_reruns"),
        "time_steps": Setting("scene_time_steps"),
        "wrong": Setting("stability.wrong"),
        "departure": Setting("stability.left"),
    },
)
def stability(
    full_order: list[paths.File],
    reruns: list[paths.File],
    subspaces: list[paths.File],
    sweeps: list[paths.File],
    reduced_reruns: pd.DataFrame,
    time_steps: Mapping[str, float],
    wrong: float,
    departure: float,
) -> pd.DataFrame:
    """Rows of the study's reduced runs (experiment "rerun"), then of short runs ("sweep").

    Method "full" with position basis "full" is the full-order run. The error of a "rerun" row is
    taken within the horizon, the error of a "sweep" row over the whole run.

    Parameters
    ----------
    time_steps : scene -> time step h in seconds
    """
    runs = pd.concat(
        [_full_order_rows(full_order), _rerun_rows(reruns, subspaces, reduced_reruns)],
        ignore_index=True,
    )
    runs = runs.assign(h=runs.scene.map(time_steps), stiffness_ratio=1.0, experiment="rerun")
    rows = pd.concat([runs, joined(sweeps).assign(experiment="sweep")], ignore_index=True)
    return rows.assign(outcome=outcomes(rows, wrong, departure))


def outcomes(runs: pd.DataFrame, wrong: float, departure: float) -> list[str]:
    """Outcome of each of ``runs``: ``wrong`` limits the error, ``departure`` relative extent."""
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


def _full_order_rows(files: list[paths.File]) -> pd.DataFrame:
    """Rows of the full-order runs in ``files``; their energy ratio is 1, their error 0."""
    rows = []
    for run in files:
        with open_hdf5(run.path) as file:
            extents = np.ptp(file["positions"][...], axis=1).max(axis=1)
        finite = bool(np.isfinite(extents).all())
        rows.append((run["scene"], finite, float(extents[1:].max() / extents[0])))
    made = pd.DataFrame(rows, columns=["scene", "finite", "max_extent"])
    return made.assign(method="full", position_basis="full", energy_ratio=1.0, relative_error=0.0)


def _rerun_rows(
    reruns: list[paths.File], subspaces: list[paths.File], reduced_reruns: pd.DataFrame
) -> pd.DataFrame:
    """Reduced runs of the training motion, with their error within the horizon as the error."""
    local = joined(reruns).assign(position_basis="full", k=np.nan)
    runs = pd.concat([local, joined(subspaces)], ignore_index=True)
    runs = runs.drop(columns="relative_error")
    errors = trained(reduced_reruns)[[*KEYS, "relative_error_within_horizon"]]
    errors = errors.rename(columns={"relative_error_within_horizon": "relative_error"})
    return runs.merge(errors, on=KEYS, how="left", validate="one_to_one")


@table(
    title="Every reduction in every hard case",
    columns=(
        text("case", "name of the hard case"),
        *shared("method"),
        flag("bounded_projections", "no state makes projections of the reduced group large"),
        *shared("k r gain frames"),
        flag("finite", "no frame blew up", compared="error", tolerance=FRAGILE),
        *shared("blowup_frame"),
        number(
            "max_extent", "largest extent over the scale of the full-order run", compared="error"
        ),
        number(
            "objective_rise",
            "largest in one iteration, over the first value of its frame",
            compared="skipped",
        ),
        text("outcome", "how the reduction fared", compared="error", tolerance=FRAGILE),
        text("why", "reason of a refusal or of an expected failure", compared="error"),
    ),
    reads={"parts": Every(paths.HARD_CASES)},
)
def hard_cases(parts: list[paths.File]) -> pd.DataFrame:
    """Rows of the files ``parts`` in the order of the cases and methods."""
    return joined(parts)
