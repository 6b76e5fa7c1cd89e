"""Tables of asked errors, from rows worked out by hand."""

import numpy as np
import pandas as pd
import pytest

from pdrom.core.paths import ASK_SCORES, ASKS
from pdrom.core.store import write_table
from pdrom.experiments.asks import COLUMNS, SCORE_COLUMNS
from pdrom.model.held_out import FIRST
from pdrom.reduction.asked.hierarchy import AskSettings
from pdrom.tables import declared
from pdrom.tables.asks import asks, risk_factor
from pdrom.tables.asks_beside import asks_beside
from pdrom.tables.asks_cost import asks_cost
from pdrom.verification.references import read_reference
from places import ROOT


def scores(scene: str, error: float, surer: float | None = 0.001) -> pd.DataFrame:
    """What is reached where .05 is asked, with a factor of 1 and with one of 2."""
    rows = [(scene, 0.05, 1.0, "ecsw, small", error), (scene, 0.05, 2.0, "full order", surer)]
    if surer is None:
        rows[1] = (scene, 0.05, 2.0, None, None)
    return pd.DataFrame(rows, columns=SCORE_COLUMNS)


def test_the_factor_is_the_smallest_whose_risk_is_borne():
    found = pd.concat([scores(f"s{i}", 0.04 if i else 0.12) for i in range(19)])
    # one scene of 19 breaks its ask: (1 + 1) / 20
    assert risk_factor(found, 0.1) == (1.0, pytest.approx(0.1))
    # with the larger factor nobody takes the reduction
    assert risk_factor(found, 0.06) == (2.0, pytest.approx(0.05))
    assert risk_factor(found, 0.01) == (2.0, pytest.approx(0.05))


def test_what_a_larger_factor_breaks_counts_for_smaller_ones():
    found = pd.concat([scores(f"s{i}", 0.04, 0.04 if i else 0.12) for i in range(19)])
    assert risk_factor(found, 0.05) == (2.0, pytest.approx(0.1))
    assert risk_factor(found, 0.1) == (1.0, pytest.approx(0.1))


def test_a_scene_and_its_twin_are_one():
    good = pd.concat([scores(f"s{i}", 0.04) for i in range(8)])
    both = pd.concat([good, scores("s8", 0.06), scores("s8_twin", 0.06)])
    assert risk_factor(both, 0.5)[1] == pytest.approx((1 + 1) / 10)
    one = pd.concat([good, scores("s8", 0.06), scores("s8_twin", 0.04)])
    assert risk_factor(one, 0.5)[1] == pytest.approx((0.5 + 1) / 10)


def test_no_promise_no_loss():
    found = pd.concat([scores("s", np.inf, None), scores("t", 0.04, None)])
    assert risk_factor(found, 0.4) == (2.0, pytest.approx(1 / 3))


def test_the_default_factor_is_one_that_the_scores_of_the_study_give():
    expected = read_reference(declared()["asks"], ROOT / "results" / "reference" / "tables")
    assert expected is not None
    assert AskSettings().factor in set(expected.frame.factor)


@pytest.fixture
def made(tmp_path) -> pd.DataFrame:
    runs, scored = [], []
    for i in range(12):
        scene = f"s{i}"
        row = {
            "scene": scene, "motion": FIRST, "asked": 0.05, "vertices": 10 if i else 2000,
            "frames": 9, "judged": i != 3, "promised": i != 1,
            "error": 0.06 if i in (2, 3) else 0.04, "reduced_frames": 9 if i < 6 else 0,
            "ms_per_frame": 0.9 if i == 5 else 0.1, "full_ms": 0.2,
            "own_ms": 0.4, "full_error": 0.01, "oracle_ms": 0.05, "repairs": 0, "checks": 2,
        }  # fmt: skip
        rows = [row | {"factor": factor} for factor in (1.0, 2.0)]
        runs.append(ASKS.file(ASKS.at(str(tmp_path), scene=scene)))
        scored.append(ASK_SCORES.file(ASK_SCORES.at(str(tmp_path), scene=scene)))
        write_table(pd.DataFrame(rows, columns=COLUMNS), runs[-1].path)
        write_table(scores(scene, 0.04), scored[-1].path)
    return asks.function(runs, scored, 0.1)


def test_each_scene_has_one_factor_and_broken_promises_are_counted(made):
    assert made.factor.tolist() == [1.0] * 12
    assert made.risk.tolist() == pytest.approx([1 / 12] * 12)
    assert made[made.broken].scene.tolist() == ["s2"]
    small, large = asks_cost.function(made).to_dict("records")
    assert (small["asks"], small["promised"], small["judged"]) == (11, 10, 9)
    assert (small["broken"], small["reduced"]) == (1, 2)
    assert small["worst"] == pytest.approx(1.2)
    assert (small["over_full"], small["over_full_most"]) == pytest.approx((0.5, 4.5))
    assert (small["over_own"], small["over_own_most"]) == pytest.approx((0.25, 2.25))
    assert (small["full_over_own"], small["oracle_over_own"]) == pytest.approx((0.5, 0.125))
    assert large["over_full"] == pytest.approx(0.5)
    assert large["over_own"] == pytest.approx(0.25)


def test_other_ways_stand_on_the_same_axes(made):
    choices = pd.DataFrame(
        {
            "scene": ["s0", "s1", "s2"], "tolerance": 0.05, "found": [True, True, False],
            "relative_error_within_horizon": [0.01, 0.1, np.nan],
            "error_heldout": [0.02, 0.01, np.nan], "ms_per_frame": [1.0, 3.0, np.nan],
        }
    )  # fmt: skip
    guard = pd.DataFrame(
        {
            "action": ["none", "report", "fall-back"], "relative_error": [9.0, 9.0, 0.1],
            "relative_cost": [1.0, 1.0, 2.0],
        }
    )  # fmt: skip
    frames = pd.DataFrame({"scene": ["s0", "s1", "s2"], "ms_per_frame": [2.0, 2.0, 2.0]})
    ways = asks_beside.function(made, choices, guard, frames).set_index("way")
    assert (ways.error == 0.05).all()
    # of twelve runs one is not judged, and one makes no promise
    expected = {
        "asked": (11, 10, 1, 1.2, 0.25),
        "full order": (11, 10, 0, 0.2, 0.5),
        "hindsight": (11, 11, 0, np.nan, 0.125),
        "chosen": (3, 2, 1, 2.0, 1.0),
        "fall-back": (1, 1, 1, 2.0, 2.0),
    }
    found = ways[["runs", "answers", "broken", "worst", "over_own"]]
    assert list(found.index) == list(expected)
    np.testing.assert_allclose(found.to_numpy(float), list(expected.values()))
