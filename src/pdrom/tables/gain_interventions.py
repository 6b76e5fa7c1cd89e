"""Table gain_interventions: lower the gain and leave everything else; does the error fall?

A correlation of gain and error over methods may stand for anything in which the methods differ. The
methods compared here share basis and size and differ in what is sampled.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from pdrom.artifact.reads import TableOf
from pdrom.tables.gain_prediction import judged_runs
from pdrom.tables.kit.declaration import compared, integer, number, table, text

RESAMPLES, SEED = 2000, 1
STEPS = {
    "whole elements for single entries": ("deim", "block-deim"),
    "three elements a mode for one": ("block-deim", "gappy"),
    "a gain of at most two": ("gappy", "bounded"),
}
_CELL = ["scene", "group", "r"]


@table(
    title="What the error does when the gain is lowered and the basis stays",
    columns=(
        text("step", f"one of: {', '.join(STEPS)}"),
        text("method_before", "method before the step"),
        text("method_after", "method after it, on the same basis"),
        compared("share", integer("pairs", "scenes, groups and sizes at which both methods ran")),
        compared("share", integer("scenes", "scenes among them")),
        compared("share", number("gain_ratio", "median of the gain after over that before")),
        compared(
            "share", number("error_ratio", "median of the error of the run after over that before")
        ),
        compared(
            "share",
            number(
                "error_ratio_low", "2.5 % quantile of this median, scenes resampled (bootstrap)"
            ),
        ),
        compared("share", number("error_ratio_high", "97.5 % quantile")),
        compared("share", number("fallen_share", "pairs whose error falls")),
        compared("share", integer("scenes_fallen", "scenes whose median error ratio is below one")),
        compared(
            "share",
            number("p_value", "two-sided sign test over all scenes, for which a tie is no fall"),
        ),
    ),
    reads={"reruns": TableOf("reduced_reruns"), "reconstruction": TableOf("reconstruction_error")},
)
def gain_interventions(reruns: pd.DataFrame, reconstruction: pd.DataFrame) -> pd.DataFrame:
    """One row per step; counted are the runs of `pdrom.tables.gain_prediction`.

    Sizes and groups of one scene are no independent observations: intervals draw whole scenes, the
    test counts scenes. Errors below the sensitivity floor count as the floor. A run that ended
    early has an infinite error; a pair of two such runs says nothing and is left out.
    """
    runs = judged_runs(reruns, reconstruction)
    pairs = {name: _pairs(runs, *methods) for name, methods in STEPS.items()}
    rows = [
        {"step": name, "method_before": before, "method_after": after, **_summary(pairs[name])}
        for name, (before, after) in STEPS.items()
        if len(pairs[name])
    ]
    return pd.DataFrame(rows)


def _pairs(runs: pd.DataFrame, before: str, after: str) -> pd.DataFrame:
    """Scene, ratio of gains and ratio of errors of each pair."""
    error = np.maximum(runs.error, runs.sensitivity_floor)
    runs = runs[[*_CELL, "method", "gain"]].assign(error=error)
    one, other = (runs[runs.method == m].drop(columns="method") for m in (before, after))
    both = one.merge(other, on=_CELL, suffixes=("_before", "_after"))
    both = both[np.isfinite(both.error_before) | np.isfinite(both.error_after)]
    return pd.DataFrame(
        {
            "scene": both.scene,
            "gain": both.gain_after / both.gain_before,
            "error": both.error_after / both.error_before,
        }
    )


def _summary(pairs: pd.DataFrame) -> Mapping[str, float]:
    # statistics take a second to load, which planning does not need
    from scipy.stats import binomtest

    by_scene = pairs.groupby("scene").error
    fallen = int((by_scene.median() < 1.0).sum())
    low, high = _interval([values.to_numpy(float) for _, values in by_scene])
    return {
        "pairs": len(pairs),
        "scenes": by_scene.ngroups,
        "gain_ratio": float(pairs.gain.median()),
        "error_ratio": float(pairs.error.median()),
        "error_ratio_low": low,
        "error_ratio_high": high,
        "fallen_share": float((pairs.error < 1.0).mean()),
        "scenes_fallen": fallen,
        "p_value": float(binomtest(fallen, by_scene.ngroups).pvalue),
    }


def _interval(scenes: list[np.ndarray]) -> tuple[float, float]:
    """Percentiles of the median over all values, with the scenes drawn with replacement."""
    drawn = np.random.default_rng(SEED).integers(len(scenes), size=(RESAMPLES, len(scenes)))
    medians = [np.median(np.concatenate([scenes[i] for i in row])) for row in drawn]
    low, high = np.percentile(medians, [2.5, 97.5], method="inverted_cdf")
    return float(low), float(high)
