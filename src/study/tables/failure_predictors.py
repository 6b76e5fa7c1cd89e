"""Table failure_predictors: which number tells failing runs from others, pooled and by method."""

import numpy as np
import pandas as pd

from study.artifact.reads import TableOf
from study.tables.gain_prediction import best_threshold, failures_ordered, judged_runs
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.gains import ORTHOGONAL, reruns_with_gain

EVERY, WITHIN = "all", "within"
PREDICTORS = ("gain", "reach", "contraction", "small_gain", "spectral_radius")
TARGETS = ("failed", "blown up")
_KEYS = ["scene", "group", "method", "r"]


@table(
    title="Which number known before a run tells failing runs from others",
    columns=(
        text("target", f"one of: {', '.join(TARGETS)}"),
        text("predictor", f"one of: {', '.join(PREDICTORS)}"),
        text("method", f"method of the runs; {EVERY}, or {WITHIN}: pairs of the same method"),
        compared("share", integer("runs", "runs that count")),
        compared("share", integer("failed", "runs among them that fail, or blow up")),
        compared(
            "share",
            number("failures_ordered", "probability that a failed run has the larger value of two"),
        ),
        compared(
            "skipped", number("threshold", "of the predictor that separates failed runs best")
        ),
        compared("share", number("misclassified_share", "runs on its wrong side")),
        compared("share", integer("failed_below_one", "failed runs with a value below one")),
        compared("share", integer("below_one", "runs with a value below one")),
    ),
    reads={
        "bounds": TableOf("bounds"),
        "reruns": TableOf("reduced_reruns"),
        "reconstruction": TableOf("reconstruction_error"),
    },
)
def failure_predictors(
    bounds: pd.DataFrame, reruns: pd.DataFrame, reconstruction: pd.DataFrame
) -> pd.DataFrame:
    """For each target and predictor a row for all runs, for pairs within a method, for each method.

    Counted are runs for which every predictor is known, the same ones for each. "failed" are runs
    of `study.tables.gain_prediction` (the basis suffices) whose error exceeds its limit; "blown up"
    are those that ended early, among all runs of sampled methods.
    """
    rows = []
    for target, runs in predicted_runs(bounds, reruns, reconstruction).items():
        for predictor in PREDICTORS if len(runs) else ():
            rows += [
                {"target": target, "predictor": predictor, **row} for row in _rows(runs, predictor)
            ]
    return pd.DataFrame(rows)


def predicted_runs(
    bounds: pd.DataFrame, reruns: pd.DataFrame, reconstruction: pd.DataFrame
) -> dict[str, pd.DataFrame]:
    """Runs with all predictors and ``failed`` for each target, see `failure_predictors`."""
    known = bounds[[*_KEYS, *PREDICTORS[1:]]].astype({"r": "int64"})
    judged = judged_runs(reruns, reconstruction)
    every = reruns_with_gain(reruns, reconstruction)
    every = every[(every.method != ORTHOGONAL) & every.gain.notna()]
    every = every.assign(failed=every.finite.map({True: False, False: True}))
    return {
        target: runs.merge(known, on=_KEYS, how="inner").dropna(subset=list(PREDICTORS))
        for target, runs in zip(TARGETS, (judged, every), strict=True)
    }


def _rows(runs: pd.DataFrame, predictor: str) -> list[dict]:
    own = [{"method": m, **_row(part, predictor)} for m, part in runs.groupby("method")]
    pairs = [row["failed"] * (row["runs"] - row["failed"]) for row in own]
    both = [(n, row["failures_ordered"]) for n, row in zip(pairs, own, strict=True) if n]
    within = None
    if both:
        within = float(np.average([v for _, v in both], weights=[n for n, _ in both]))
    counted = _counts(runs)
    return [
        {"method": EVERY, **_row(runs, predictor)},
        {"method": WITHIN, **counted, "failures_ordered": within},
        *own,
    ]


def _counts(runs: pd.DataFrame) -> dict:
    return {"runs": len(runs), "failed": int(runs.failed.sum())}


def _row(runs: pd.DataFrame, predictor: str) -> dict:
    x, failed = runs[predictor].to_numpy(float), runs.failed.to_numpy(bool)
    threshold, mistakes = best_threshold(x, failed)
    return {
        **_counts(runs),
        "failures_ordered": failures_ordered(x, failed),
        "threshold": threshold,
        "misclassified_share": mistakes / len(runs),
        "failed_below_one": int(np.sum(failed & (x < 1.0))),
        "below_one": int(np.sum(x < 1.0)),
    }
