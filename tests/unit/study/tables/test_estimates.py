"""Tables of the estimates, from rows worked out by hand."""

import pandas as pd
import pytest

from pdrom.core.store import read_table, write_table
from study.artifact.paths import COMPANION_TIMES, ESTIMATES, RERUNS_HELDOUT, RERUNS_TRAIN
from study.experiments.companion_times import COLUMNS as TIMES
from study.experiments.estimates import COLUMNS
from study.tables.alarms import alarms
from study.tables.estimates import estimates
from study.tables.model_choice import model_choice

# method, position basis, k, r, error (None: blew up), estimate, frame in which the guard saw it
RUNS = [
    ("pod", "full", None, 6, 0.02, 0.03, 4),
    ("deim", "full", None, 6, 0.5, 0.4, None),
    ("deim", "full", None, 10, None, 7.0, 2),
    ("full", "pod", 10, 90, 0.04, 0.05, None),
    ("ecsw", "pod", 10, 20, 0.08, 0.07, None),
    ("ecsw", "pod", 20, 40, 0.001, 0.01, None),
]
ALARMS = ("trained-range", "estimate")
KEYS = ["scene", "group", "method", "position_basis", "k", "r"]


@pytest.fixture
def read(tmp_path):
    """What the tables read, by name."""
    rows = []
    for split in ("train", "heldout"):
        for method, basis, k, r, error, value, _ in RUNS:
            group = "spring" if basis == "full" else "all"
            labels = ("calm", group, method, basis, k, r, split)
            rows.append((*labels, error, value, value + 0.01, 0.01))
    part = ESTIMATES.at(str(tmp_path), scene="calm")
    write_table(pd.DataFrame(rows, columns=COLUMNS), part)
    times = COMPANION_TIMES.at(str(tmp_path), scene="calm")
    write_table(pd.DataFrame([("calm", 30, 0.4, 1.6)], columns=TIMES), times)
    reruns = pd.DataFrame(rows, columns=COLUMNS).query("split == 'train'").drop(columns="split")
    reruns = reruns.assign(ms_per_frame=0.2, horizon_frame=9, motion="heldout")
    guarded = pd.DataFrame(
        [("calm", "spring", m, r, e, f) for m, basis, _, r, e, _, f in RUNS if basis == "full"],
        columns=["scene", "group", "method", "r", "relative_error", "guard_frame"],
    ).assign(guard_count=0, motion="heldout")
    local = {"scene": "calm", "group": "spring", "method": "all"}
    files = [place.at(str(tmp_path), **local) for place in (RERUNS_TRAIN, RERUNS_HELDOUT)]
    for file in files:
        write_table(guarded, file)
    made = estimates([ESTIMATES.file(part)], [COMPANION_TIMES.file(times)], reruns)
    places = (RERUNS_TRAIN.files(files[:1]), RERUNS_HELDOUT.files(files[1:]))
    return made, reruns, places


def test_estimates_stand_beside_the_errors(read):
    made, _, _ = read
    rows = made[made.split == "heldout"].set_index(["method", "position_basis", "r"])
    assert rows.loc[("pod", "full", 6), "ratio"] == pytest.approx(1.5)
    assert rows.loc[("ecsw", "pod", 20), "within"]
    assert not rows.loc[("ecsw", "pod", 40), "within"]
    assert not rows.loc[("ecsw", "pod", 40), "resolved"]
    assert rows.loc[("ecsw", "pod", 20), "resolved"]
    assert pd.isna(rows.loc[("deim", "full", 10), "ratio"])
    assert pd.isna(rows.loc[("deim", "full", 10), "within"])
    assert made.overhead.tolist() == [2.0] * len(made)
    assert made.full_order_share.tolist() == [0.25] * len(made)


def test_alarms_of_guard_and_estimate_are_counted_over_the_same_runs(read):
    made, reruns, (train, heldout) = read
    found = alarms(made, reruns, reruns, train, heldout, 0.15, "trained-range")
    found = found.set_index(["split", "alarm"])
    for split in ("train", "heldout"):
        guard, own = found.loc[(split, "trained-range")], found.loc[(split, "estimate")]
        assert (guard.runs, guard.failed, own.runs, own.failed) == (3, 2, 3, 2)
        assert (guard.detected_share, guard.false_share) == (0.5, 1.0)
        assert (own.detected_share, own.false_share) == (1.0, 0.0)


def test_alarms_of_all_held_out_motions_are_counted_together(read):
    made, reruns, (train, heldout) = read
    kicked = made[made.split == "heldout"].assign(split="kick", largest_estimate=0.0)
    both = pd.concat([made, kicked]), pd.concat([reruns, reruns.assign(motion="kick")])
    rows = read_table(heldout[0].path)
    write_table(pd.concat([rows, rows.assign(motion="kick", guard_frame=1)]), heldout[0].path)
    found = alarms(both[0], reruns, both[1], train, heldout, 0.15, "trained-range")
    guard, own = (found.set_index(["split", "alarm"]).loc[("heldout", a)] for a in ALARMS)
    assert (guard.runs, guard.failed, own.runs, own.failed) == (6, 4, 6, 4)
    # the kicked runs are all noticed by the guard, and none by the estimate
    assert (guard.detected_share, guard.false_share) == (0.75, 1.0)
    assert (own.detected_share, own.false_share) == (0.5, 0.0)


def test_what_counts_is_the_largest_estimate_of_a_run(read):
    made, reruns, (train, heldout) = read
    found = alarms(made, reruns, reruns, train, heldout, 0.035, "trained-range")
    assert found[found.alarm == "estimate"].false_share.tolist() == [1.0, 1.0]


def test_a_guard_that_listens_to_the_estimate_has_no_other_row(read):
    made, reruns, (train, heldout) = read
    found = alarms(made, reruns, reruns, train, heldout, 0.15, "estimate")
    assert found.alarm.tolist() == ["estimate", "estimate"]


def test_the_cheapest_model_within_the_tolerance_is_chosen(read):
    made, reruns, _ = read
    kicked = reruns.assign(motion="kick", frames=9, blowup_frame=None)
    kicked["relative_error_within_horizon"] *= 1000.0
    chosen = model_choice(made, reruns, kicked, (0.1, 0.03, 0.001), 1.0).set_index("tolerance")
    assert (chosen.loc[0.1, "method"], chosen.loc[0.1, "r"]) == ("ecsw", 20)
    assert (chosen.loc[0.03, "k"], chosen.loc[0.03, "r"]) == (20, 40)
    assert chosen.loc[[0.1, 0.03], "met"].all()
    # met for the motion that it was chosen on, and missed on another one
    assert not chosen.loc[[0.1, 0.03], "met_heldout"].any()
    assert not chosen.loc[0.001, "found"]


def test_a_model_is_chosen_only_with_room_for_an_estimate_that_is_too_small(read):
    """The tolerance is the estimate of the cheapest model: met as it is, not with a margin."""
    made, reruns, _ = read
    inside = made[(made.split == "heldout") & (made.position_basis != "full")]
    tolerance = float(inside.sort_values("r").estimate.iloc[0])
    unseen = reruns.assign(frames=9, blowup_frame=None)
    chosen = (model_choice(made, reruns, unseen, (tolerance,), f) for f in (1.0, 1.3))
    first, safer = (found.iloc[0] for found in chosen)
    assert (first.r, safer.r) == (20, 40)
    assert first.estimate == tolerance
    assert 1.3 * safer.estimate <= tolerance


def test_no_runs_leave_empty_tables(read, tmp_path):
    _, reruns, _ = read
    path = ESTIMATES.at(str(tmp_path / "none"), scene="calm")
    write_table(pd.DataFrame([], columns=COLUMNS), path)
    assert len(estimates([ESTIMATES.file(path)], [], reruns)) == 0
