"""What is advised follows from the tables: by hand, on a few rows."""

import numpy as np
import pandas as pd
import pytest

from pdrom.report.advice import on_choices, on_effects, on_resolution


def effects(**changes) -> pd.DataFrame:
    table = pd.DataFrame(
        {
            "effect": ["spring", "bending", "floor", "gravity"],
            "moved": [None, 1e-9, 0.0, 0.5],
            "sensitivity_floor": 1e-6,
            "above_floor": pd.array([None, False, False, True], dtype="boolean"),
            "acting_frames": [9, 9, 0, 9],
            "own_ms": [0.3, 0.2, 0.01, np.nan],
            "saved_ms": [np.nan, 0.25, np.nan, np.nan],
        }
    )
    return table.assign(**changes)


def test_what_does_nothing_is_named_with_what_it_costs():
    said = list(on_effects(effects()))
    assert "1e-06" in said[0]
    assert said[1] == (
        "  bending: moves the run by 1e-09, never above the floor; "
        "without it a frame takes 0.25 ms less (it costs 0.2)"
    )
    assert said[2] == "  floor: exerts no force, never above the floor; it costs 0.01 ms a frame"
    assert said[3].endswith("without: spring, gravity (0.5)")


def test_where_everything_acts_that_is_said():
    said = list(on_effects(effects(above_floor=pd.array([None, True, True, True], "boolean"))))
    assert said[1] == "  every effect that can be left out acts above the floor"


@pytest.fixture
def points() -> pd.DataFrame:
    columns = ["group", "method", "position_basis", "k", "r", "iterations",
               "relative_error_within_horizon", "ms_per_frame"]  # fmt: skip
    rows = [
        (None, "full", "full", None, None, 10, 0.0, 2.0),
        ("spring", "gappy", "full", None, 20, 10, 0.03, 1.5),
        ("all", "ecsw-1e-02", "pod", 20, 90, 10, 0.008, 0.2),
        ("all", "ecsw-1e-02", "pod", 40, 150, 10, 0.002, 0.4),
        (None, "fom", "full", None, None, 5, 0.02, 1.0),
        (None, "fom-anderson", "full", None, None, 5, 0.009, 1.2),
    ]
    return pd.DataFrame(rows, columns=columns)


def test_choices_keep_both_wishes_the_quickest_first(points):
    said, fits = on_choices(points, 0.01, 1.0)
    assert fits
    assert said[1:3] == [
        "  nothing measured keeps both",
        "  fastest with this error: with Anderson acceleration, K = 5: error 0.009, 1.2 ms a frame",
    ]
    assert said[-2:] == [
        "  ecsw-1e-02 in a pod subspace, k = 20, r = 90: error 0.008, 0.2 ms a frame",
        "  ecsw-1e-02 in a pod subspace, k = 40, r = 150: error 0.002, 0.4 ms a frame",
    ]


def test_with_a_time_alone_the_least_error_comes_first(points):
    said, fits = on_choices(points, None, 1.6)
    assert fits
    assert said[-3].startswith("  ecsw-1e-02 in a pod subspace, k = 40")
    assert said[-1] == "  gappy of spring, r = 20: error 0.03, 1.5 ms a frame"


def test_what_cannot_be_had_is_said_with_what_comes_nearest(points):
    said, fits = on_choices(points, 1e-9, 1e-3)
    assert not fits
    assert "  nothing measured is as accurate" in said
    assert "  fastest with this error: full order, K = 10: error 0, 2 ms a frame" in said


def test_resolutions_come_from_the_scaling():
    table = pd.DataFrame(
        {
            "method": ["fom", "fom", "fom", "ecsw"], "threads": [1, 1, 2, 1],
            "vertices": [400, 1600, 400, 1600], "ms_per_iteration": [0.05, 0.3, 0.01, 0.02],
        }
    )  # fmt: skip
    said = list(on_resolution(table, 10, 1.0))
    assert said[1:] == [
        "  full order: 400 vertices in 0.5 ms",
        "  ecsw: 1,600 vertices in 0.2 ms, the largest measured",
    ]
    assert "even 400 vertices take 0.5 ms" in list(on_resolution(table, 10, 0.1))[1]
    assert "not measured" in list(on_resolution(table[:0], 10, 1.0))[1]
