"""Table failure_transfer: does a limit learned on some scenes tell failures in another one?"""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from study.artifact.reads import TableOf
from study.tables.failure_predictors import EVERY, PREDICTORS, WITHIN, predicted_runs
from study.tables.gain_prediction import best_threshold, failures_ordered
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.families import families


@table(
    title="Predictors of failure in scenes that their limit was not fitted to",
    columns=(
        text("predictor", f"one of: {', '.join(PREDICTORS)}"),
        text("method", f"method of the runs; {EVERY}, or {WITHIN}: a limit for each method"),
        text("scene", f"scene that is left out, with its twin; {EVERY}: over all of them"),
        compared("share", integer("runs", "runs of the scene that count")),
        compared("share", integer("failed", "runs among them that fail")),
        compared(
            "skipped",
            number("threshold", "that separates the failed runs of other families of scenes best"),
        ),
        compared("share", number("misclassified_share", "runs of the scene on its wrong side")),
        compared(
            "share",
            number("majority_share", "the same if all are called what most of the others are"),
        ),
        compared(
            "share",
            number("failures_ordered", "probability that a failed run has the larger value of two"),
        ),
    ),
    reads={
        "bounds": TableOf("bounds"),
        "reruns": TableOf("reduced_reruns"),
        "reconstruction": TableOf("reconstruction_error"),
    },
)
def failure_transfer(
    bounds: pd.DataFrame, reruns: pd.DataFrame, reconstruction: pd.DataFrame
) -> pd.DataFrame:
    """Each scene is left out once, its twin with it; counted are the runs of `failure_predictors`.

    A predictor is of use in a new scene if its share of mistakes is below that of calling all runs
    what most runs of the other scenes are. ``bounds``, ``reruns`` and ``reconstruction`` are the
    tables of `predicted_runs`.
    """
    runs = predicted_runs(bounds, reruns, reconstruction)["failed"]
    rows: list[dict] = []
    for predictor in PREDICTORS if len(runs) else ():
        pooled = list(_left_out(runs, predictor))
        own = {m: list(_left_out(part, predictor)) for m, part in runs.groupby("method")}
        within = [row for left_out in own.values() for row in left_out]
        for method, found in {EVERY: pooled, WITHIN: within, **own}.items():
            named = [] if method == WITHIN else found
            for row in [_over_all(found), *named] if found else []:
                rows.append({"predictor": predictor, "method": method, **row})
    return pd.DataFrame(rows)


def _left_out(runs: pd.DataFrame, predictor: str) -> Iterator[dict]:
    """A row for each scene, judged by those of other families."""
    family = families(runs.scene)
    for scene, own in runs.groupby("scene", sort=False):
        others = runs[~family.isin(family[own.index])]
        if others.empty:
            continue
        threshold, _ = best_threshold(*_values(others, predictor))
        x, failed = _values(own, predictor)
        majority = others.failed.mean() > 0.5
        yield {
            "scene": scene,
            "runs": len(own),
            "failed": int(failed.sum()),
            "threshold": threshold,
            "misclassified_share": float(np.mean((x > threshold) != failed)),
            "majority_share": float(np.mean(failed != majority)),
            "failures_ordered": failures_ordered(x, failed),
        }


def _values(runs: pd.DataFrame, predictor: str) -> tuple[np.ndarray, np.ndarray]:
    return runs[predictor].to_numpy(float), runs.failed.to_numpy(bool)


def _over_all(rows: list[dict]) -> dict:
    """Shares over all runs; the order counts pairs of runs of one scene (and method)."""
    runs = np.array([row["runs"] for row in rows])
    failed = np.array([row["failed"] for row in rows])
    ordered = np.array([row["failures_ordered"] for row in rows], float)
    pairs, known = failed * (runs - failed), np.isfinite(ordered)
    return {
        "scene": EVERY,
        "runs": int(runs.sum()),
        "failed": int(failed.sum()),
        **{
            key: float(np.average([row[key] for row in rows], weights=runs))
            for key in ("misclassified_share", "majority_share")
        },
        "failures_ordered": (
            float(np.average(ordered[known], weights=pairs[known])) if known.any() else None
        ),
    }
