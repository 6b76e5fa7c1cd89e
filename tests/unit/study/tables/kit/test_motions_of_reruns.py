import numpy as np
import pandas as pd
import pytest

from study.tables.kit.reruns import KEYS, TRAIN, over_motions, trained, with_held_out

RUN = {"scene": "a", "group": "g", "method": "pod", "position_basis": "full", "k": None}


def rows(*runs: dict) -> pd.DataFrame:
    """Table reduced_reruns, as far as it is read."""
    usual = {"motion": "kick", "frames": 9, "blowup_frame": None, "horizon_frame": 9}
    return pd.DataFrame([RUN | usual | run for run in runs])


def test_an_error_is_the_median_over_the_motions_that_can_be_judged():
    error = "relative_error_within_horizon"
    table = rows(
        {"r": 6, error: 0.1}, {"r": 6, error: 0.3}, {"r": 6, error: 0.2},
        # ended early; no frame before the horizon; beyond the rank
        {"r": 10, error: None, "frames": 3, "blowup_frame": 3}, {"r": 10, error: 0.5},
        {"r": 10, error: 0.4}, {"r": 10, error: None, "horizon_frame": 0},
        {"r": 20, error: None, "frames": 0},
        {"r": 6, error: 0.7, "motion": TRAIN}, {"r": 20, error: 0.8, "motion": TRAIN},
    )  # fmt: skip
    found = over_motions(table).set_index("r")
    assert found.loc[6, "error_heldout"] == pytest.approx(0.2)
    assert tuple(found.loc[6, ["error_heldout_low", "error_heldout_high"]]) == (0.1, 0.3)
    assert tuple(found.loc[10, ["error_heldout", "error_heldout_high"]]) == (0.5, np.inf)
    assert found.motions.to_dict() == {6: 3, 10: 3}
    beside = with_held_out(trained(table)[KEYS], table)
    assert beside.error_heldout.isna().tolist() == [False, True]
