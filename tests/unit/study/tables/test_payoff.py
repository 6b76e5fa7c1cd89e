"""Table payoff against a count by hand: accurate runs, the fastest of each scene, who pays."""

from statistics import median

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study.tables.kit.results import FAILED
from study.tables.payoff import payoff

LABELS = ["scene", "group", "method", "position_basis", "k", "r"]
ERROR = "relative_error_within_horizon"
RUN = st.tuples(
    st.sampled_from("abc"),
    st.sampled_from(["deim", "pod"]),
    st.sampled_from([0.5 * FAILED, FAILED, 1.01 * FAILED]),
    st.sampled_from([None, 0.5, 1.0, 2.0, 8.0]),  # speed-up, if it was timed
    st.sampled_from([None, 0.2, 0.3]),  # error of the held-out motion, if it was run
)


def tables(runs) -> pd.DataFrame:
    """Reruns of both motions; the number of the run is its size r."""
    rows = [
        (scene, "spring", method, "full", None, r, error, speedup, 1.0, held)
        for r, (scene, method, error, speedup, held) in enumerate(runs)
    ]
    both = pd.DataFrame(rows, columns=[*LABELS, ERROR, "speedup", "max_extent", "held"])
    both = both.astype({"speedup": float, "held": float, "k": "Int64"})
    held = both[both.held.notna()].drop(columns=ERROR).rename(columns={"held": ERROR})
    held = held.assign(motion="kick", frames=9, blowup_frame=None, horizon_frame=9, speedup=None)
    return pd.concat([both.drop(columns="held").assign(motion="train"), held])


@given(st.lists(RUN, min_size=1, max_size=12))
def test_the_fastest_accurate_run_of_each_scene_decides(runs):
    timed = [run for run in runs if run[3] is not None]
    made = payoff.checked(payoff(tables(runs)))
    assert made.method.tolist() == list(dict.fromkeys(run[1] for run in timed))
    for row in made.itertuples():
        own = [run for run in timed if run[1] == row.method]
        best = {}
        for scene, _, error, speedup, _ in own:
            if error <= FAILED:
                best[scene] = max(best.get(scene, 0.0), speedup)
        assert (row.scenes, row.accurate) == (len({run[0] for run in own}), len(best))
        assert row.pays == sum(speed > 1.0 for speed in best.values())
        assert row.pays + row.loses == row.accurate
        if best:
            found = (row.least_speedup, row.best_speedup, row.most_speedup)
            speeds = best.values()
            assert found == pytest.approx((min(speeds), median(speeds), max(speeds)))
            assert 0.5 * FAILED <= row.error_train <= FAILED


def test_the_held_out_error_is_that_of_the_fastest_run():
    runs = [("a", "deim", 0.01, 2.0, 0.2), ("a", "deim", 0.02, 8.0, 0.3)]
    runs += [("b", "deim", 0.03, 8.0, None), ("b", "deim", 1.0, 9.0, 0.2)]
    (row,) = payoff(tables(runs)).itertuples()
    assert (row.error_train, row.error_heldout, row.heldout) == (0.025, 0.3, 1)


def test_who_pays_is_scored_on_the_held_out_motions():
    """Accurate and fast, accurate and slow, and fast but off by more than a tenth held out."""
    runs = [("a", "deim", 0.01, 2.0, 0.05), ("b", "deim", 0.02, 0.5, 0.05)]
    reruns = tables([*runs, ("c", "deim", 0.05, 4.0, 0.2)])
    held = reruns[reruns.motion != "train"]
    motions = [held.assign(**{ERROR: factor * held[ERROR]}) for factor in (0.5, 1.5)]
    (row,) = payoff(pd.concat([reruns, *motions])).itertuples()
    assert (row.accurate, row.pays, row.loses) == (3, 2, 1)
    assert (row.accurate_heldout, row.pays_heldout, row.heldout) == (2, 1, 3)
    found = (row.error_heldout_low, row.error_heldout, row.error_heldout_high)
    assert found == pytest.approx((0.025, 0.05, 0.075))


def test_what_did_not_run_does_not_count():
    reruns = tables([("a", "deim", 0.01, 2.0, None), ("b", "deim", 0.01, 2.0, None)])
    (row,) = payoff(reruns.assign(max_extent=[1.0, None])).itertuples()
    assert (row.scenes, row.accurate, row.heldout) == (1, 1, 0)
