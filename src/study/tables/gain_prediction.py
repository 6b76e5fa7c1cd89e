"""Table gain_prediction: does a number known before the run say whether the run fails?"""

from collections.abc import Callable

import numpy as np
import pandas as pd

from study.artifact.reads import TableOf
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.gains import ORTHOGONAL, reruns_with_gain

FAILED = 0.1  # error within the horizon above which a run counts as failed
EVERY = "all"
DECADES = 4  # gains above 10^4 are counted together
PREDICTORS: dict[str, Callable[[pd.DataFrame], pd.Series]] = {
    "gain": lambda runs: runs.gain,
    "reconstruction error": lambda runs: runs.reconstruction_error,
    "gain x best error": lambda runs: runs.gain * runs.orthogonal_reconstruction,
}


@table(
    title="What numbers known before a run say about its failure",
    columns=(
        text("predictor", f"one of: {', '.join(PREDICTORS)}"),
        text("lower", f"smallest gain of the decade, or {EVERY}"),
        text("upper", f"largest gain of the decade, or {EVERY}"),
        compared("share", integer("runs", "runs that count")),
        compared("share", integer("failed", "runs among them that fail")),
        compared("share", number("failed_share", "their share")),
        # half of the runs with a large gain are ill-conditioned
        compared("error", number("median_error", "of the runs before the horizon"), 0.5),
        compared("share", number("rank_correlation", "of predictor and error (Spearman)")),
        compared(
            "skipped", number("threshold", "of the predictor that separates failed runs best")
        ),
        compared("share", number("misclassified_share", "runs on its wrong side")),
        compared(
            "share",
            number("failures_ordered", "probability that a failed run has the larger value of two"),
        ),
    ),
    reads={"reruns": TableOf("reduced_reruns"), "reconstruction": TableOf("reconstruction_error")},
)
def gain_prediction(reruns: pd.DataFrame, reconstruction: pd.DataFrame) -> pd.DataFrame:
    """Failures by decade of the gain, then how well each predictor orders and separates the runs.

    Counted are the runs of sampled methods whose basis suffices: the orthogonal projection on it
    does not fail. A run fails if it ends before the horizon or its error there exceeds `FAILED`.
    ``reruns`` and ``reconstruction`` are the tables reduced_reruns and reconstruction_error.

    runs, failed, failed_share, median_error : of a decade ``lower`` < gain <= ``upper``, or of all
    rank_correlation : of predictor and error (Spearman), early ends tied above all others
    threshold, misclassified_share : the value that separates failed runs from others with the
        fewest mistakes, and their share
    failures_ordered : probability that a failed run has the larger value of a failed and a good one
        drawn at random (area under the ROC curve; 0.5 says nothing)
    """
    runs = judged_runs(reruns, reconstruction)
    if runs.empty:
        return runs
    rows = [{"predictor": "gain", **row} for row in _decades(runs)]
    for name, value in PREDICTORS.items():
        rows.append(
            {"predictor": name, "lower": EVERY, "upper": EVERY, **_judge(value(runs), runs)}
        )
    return pd.DataFrame(rows)


def judged_runs(reruns: pd.DataFrame, reconstruction: pd.DataFrame) -> pd.DataFrame:
    """Runs that count, with ``failed``; ``reruns``, ``reconstruction``: see `gain_prediction`."""
    runs = reruns_with_gain(reruns, reconstruction)
    fine = (runs.orthogonal_error <= FAILED) & (runs.method != ORTHOGONAL) & runs.error.notna()
    runs = runs[fine & runs.gain.notna()].copy()
    runs["failed"] = runs.error > FAILED
    return runs


def _decades(runs: pd.DataFrame) -> list[dict]:
    """Rows of the decades 1..10, 10..100, ..., and one of all that is above, singular ones too."""
    exponent = np.ceil(np.log10(runs.gain.clip(upper=10.0**DECADES + 1.0))).clip(lower=1)
    return [
        {
            "lower": f"{10.0 ** (d - 1):g}",
            "upper": f"{10.0**d:g}" if d <= DECADES else "inf",
            **_count(part),
        }
        for d, part in runs.groupby(exponent.astype(int))
    ]


def _count(runs: pd.DataFrame) -> dict:
    failed = int(runs.failed.sum())
    return {
        "runs": len(runs),
        "failed": failed,
        "failed_share": failed / len(runs),
        "median_error": float(runs.error.median()),
    }


def _judge(value: pd.Series, runs: pd.DataFrame) -> dict:
    """Counts, rank correlation and the best threshold of one predictor."""
    x, failed = value.to_numpy(float), runs.failed.to_numpy(bool)
    x = np.where(np.isnan(x), np.inf, x)  # the reconstruction does not exist
    threshold, mistakes = best_threshold(x, failed)
    varies = len(runs) > 2 and len(np.unique(x)) > 1 and runs.error.nunique() > 1
    return {
        **_count(runs),
        "rank_correlation": _ranks(x, runs.error.to_numpy(float)) if varies else None,
        "threshold": threshold,
        "misclassified_share": mistakes / len(runs),
        "failures_ordered": failures_ordered(x, failed),
    }


def _ranks(x: np.ndarray, y: np.ndarray) -> float:
    """Spearman's correlation; infinite values are tied."""
    return float(pd.Series(x).rank().corr(pd.Series(y).rank()))


def best_threshold(x: np.ndarray, failed: np.ndarray) -> tuple[float, int]:
    """Threshold t for which "x > t means failed" makes the fewest mistakes, and how many.

    t is the largest value that is not above it: one of ``x``, or 0 if all runs count as failed.
    The smallest of equally good ones is taken.
    """
    candidates = np.concatenate([[0.0], np.unique(x)])
    mistakes = [int(np.sum((x > t) != failed)) for t in candidates]
    best = int(np.argmin(mistakes))
    return float(candidates[best]), mistakes[best]


def failures_ordered(x: np.ndarray, failed: np.ndarray) -> float | None:
    """Mann-Whitney statistic of ``x`` by ``failed`` (n,) over pairs; None without both kinds."""
    many, others = int(failed.sum()), int((~failed).sum())
    if not many or not others:
        return None
    ranks = pd.Series(x).rank()[failed].sum()
    return float((ranks - many * (many + 1) / 2) / (many * others))
