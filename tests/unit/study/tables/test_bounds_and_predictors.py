"""Tables of the bounds, from rows worked out by hand."""

import numpy as np
import pandas as pd
import pytest

from pdrom.core.store import write_table
from study.artifact.paths import BOUNDS
from study.experiments.bounds import COLUMNS
from study.tables.bounds import bounds
from study.tables.failure_predictors import PREDICTORS, failure_predictors
from study.tables.failure_transfer import failure_transfer

# method, r, gain, contraction, error within the horizon (None: blew up), extent
RUNS = [
    ("pod", 6, 1.0, 0.9, 0.01, 1.0),
    ("deim", 6, 30.0, 2.0, 0.02, 1.1),
    ("deim", 10, 20.0, 8.0, 0.5, 1.2),
    ("gappy", 6, 5.0, 0.5, 0.03, 1.0),
    ("gappy", 10, 4.0, 3.0, 0.2, 1.0),
    ("deim-joint", 6, 900.0, 90.0, None, 40.0),
]


@pytest.fixture
def tables(tmp_path) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """The tables bounds, reduced_reruns and reconstruction_error of `RUNS`."""
    parts, reruns, reconstruction = [], [], []
    for method, r, gain, contraction, error, extent in RUNS:
        key = {"scene": "calm", "group": "spring", "method": method, "r": r}
        numbers = dict(zip(COLUMNS[4:], (gain, 3.0, 4.0, 100.0, contraction, 0.9), strict=True))
        parts.append(key | numbers)
        reruns.append(key | {
            "position_basis": "full", "max_extent": extent, "finite": error is not None,
            "blowup_frame": 3 if error is None else None, "relative_error": error,
            "relative_error_within_horizon": error,
        })  # fmt: skip
        reconstruction.append(
            key | {"split": "train", "relative_error": 0.1, "gain": gain, "elements_sampled": r}
        )
    path = BOUNDS.at(str(tmp_path), scene="calm")
    write_table(pd.DataFrame(parts, columns=COLUMNS), path)
    runs = pd.DataFrame(reruns)
    # in a subspace and beyond the rank: neither has bounds
    first = runs.iloc[0].to_dict()
    others = [first | {"position_basis": "pod"}, first | {"r": 99, "max_extent": None}]
    runs = pd.concat([runs, pd.DataFrame(others)], ignore_index=True)
    return bounds([BOUNDS.file(path)], runs), runs, pd.DataFrame(reconstruction)


def test_bounds_stand_beside_what_became_of_the_run(tables):
    made, _, _ = tables
    rows = made.set_index(["method", "r"])
    assert len(made) == len(RUNS)
    assert rows.loc[("deim", 10), "slack"] == pytest.approx(100.0 / 1.2)
    assert rows.loc[("deim", 10), "small_gain"] == 3.0 * 8.0
    assert not rows.loc[("deim-joint", 6), "finite"]


def test_predictors_are_judged_pooled_and_within_methods(tables):
    made = failure_predictors(*tables).set_index(["target", "predictor", "method"])
    assert set(made.index.get_level_values("predictor")) == set(PREDICTORS)
    # failed: (20, 8), (4, 3), (900, 90); not: (30, 2), (5, .5); pairs of gain and of contraction
    assert made.loc[("failed", "gain", "all"), "failures_ordered"] == pytest.approx(3 / 6)
    assert made.loc[("failed", "contraction", "all"), "failures_ordered"] == 1.0
    assert made.loc[("failed", "gain", "within"), "failures_ordered"] == 0.0
    assert made.loc[("failed", "contraction", "within"), "failures_ordered"] == 1.0
    assert made.loc[("failed", "contraction", "all"), "below_one"] == 1
    assert made.loc[("failed", "contraction", "all"), "failed_below_one"] == 0
    assert made.loc[("blown up", "contraction", "all"), "failed"] == 1
    assert made.loc[("blown up", "contraction", "deim"), "failed"] == 0


def test_no_runs_leave_empty_tables(tables, tmp_path):
    made, runs, reconstruction = tables
    path = BOUNDS.at(str(tmp_path / "none"), scene="calm")
    write_table(pd.DataFrame([], columns=COLUMNS), path)
    empty = bounds([BOUNDS.file(path)], runs)
    assert len(empty) == 0
    assert len(failure_predictors(empty, runs, reconstruction)) == 0
    assert np.isfinite(made.bound).all()


def test_a_limit_is_learned_without_the_scene_that_it_judges(tables):
    # a second scene, in which the same runs have ten times the contraction
    other = [t.assign(scene="wild") for t in tables]
    other[0]["contraction"] *= 10.0
    both = [pd.concat(pair, ignore_index=True) for pair in zip(tables, other, strict=True)]
    rows = failure_transfer(*both).set_index(["predictor", "method", "scene"])
    calm, wild = (rows.loc[("contraction", "all", scene)] for scene in ("calm", "wild"))
    # 8, 3 and 90 fail, 2 and 0.5 do not; of the other scene ten times
    assert (calm.threshold, wild.threshold) == (20.0, 2.0)
    assert calm.misclassified_share == pytest.approx(2 / 5)
    assert wild.misclassified_share == pytest.approx(2 / 5)
    assert calm.majority_share == pytest.approx(2 / 5)
    assert calm.failures_ordered == wild.failures_ordered == 1.0
    over_all = rows.loc[("contraction", "all", "all")]
    assert (over_all.runs, over_all.failed) == (10, 6)
    assert over_all.misclassified_share == pytest.approx(2 / 5)
    assert over_all.failures_ordered == 1.0
    one = failure_transfer(*tables)
    assert len(one) == 0, "nothing can be learned from other scenes"
    twins = [pd.concat([t, t.assign(scene="calm_twin")], ignore_index=True) for t in tables]
    assert len(failure_transfer(*twins)) == 0, "a twin is no other scene"
