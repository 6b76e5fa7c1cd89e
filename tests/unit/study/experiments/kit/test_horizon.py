"""Floor, horizon and the error before it, against values worked out by hand."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdrom.core.store import read_table, write_table
from pdrom.reduction.deviations import error_within
from study.experiments.kit.horizon import floor_of, horizon, horizons

PERTURBED = {
    ("a", "1e-10", 1): [0.0, 1e-9, 5e-3, 1e-9],
    ("a", "1e-10", 2): [0.0, 2e-9, 1e-9, 1.0],
    ("a", "1e-06", 1): [1.0] * 4,
    ("a", "solver", 0): [5.0] * 4,
    ("a", "heldout", 1): [1e-12, 1.0, 1.0, 1.0],
    ("b", "1e-10", 1): [1e-12, 3e-12, 2e-12, 1e-12],
    ("b", "heldout", 1): [1e-12] * 4,
}


@pytest.fixture
def perturbed() -> pd.DataFrame:
    """Perturbed runs of two scenes, a row for every seed."""
    return pd.DataFrame(
        [(*key, frame, v) for key, series in PERTURBED.items() for frame, v in enumerate(series)],
        columns=["scene", "perturbation", "seed", "frame", "relative_difference"],
    )


def test_floor_is_the_largest_over_the_seeds(perturbed):
    for table in (perturbed, perturbed.sample(frac=1.0, random_state=3)):
        assert floor_of(table, "a", 1e-10).tolist() == [0.0, 2e-9, 5e-3, 1.0]
        assert floor_of(table, "a", "heldout").tolist() == [1e-12, 1.0, 1.0, 1.0]
        assert len(floor_of(table, "b", 1e-6)) == 0


def test_horizons_of_every_scene(perturbed):
    assert horizons(perturbed, 1e-10, 1e-3) == {"a": 2, "b": 4}
    assert horizons(perturbed, 1e-10, 1e-2) == {"a": 3, "b": 4}
    assert horizons(perturbed, 1e-6, 1e-3)["a"] == 0
    assert horizons(perturbed, "heldout", 1e-3) == {"a": 1, "b": 4}


@pytest.mark.parametrize("kept", [["1e-10"], ["1e-10", "solver"]])
def test_horizons_survive_a_file(perturbed, kept, tmp_path):
    """Labels are found whether they are read back as text or, without words, as numbers."""
    write_table(perturbed[perturbed.perturbation.isin(kept)], tmp_path / "sensitivity.csv")
    assert horizons(read_table(tmp_path / "sensitivity.csv"), 1e-10, 1e-3) == {"a": 2, "b": 4}


@pytest.mark.parametrize(
    ("floor", "expected"),
    [
        ([], 0),
        ([0.0, 0.0], 2),
        ([1e-3, 1e-3], 2),
        ([0.0, 2e-3, 0.0, 5e-3], 1),
        ([1.0], 0),
        ([0.0, np.nan, 0.0], 1),
        ([0.0, 0.0, np.inf], 2),
    ],
)
def test_horizon_is_the_first_frame_above(floor, expected):
    assert horizon(np.array(floor), 1e-3) == expected


@given(st.lists(st.floats(0.0, 1.0), max_size=20), st.floats(1e-6, 0.5), st.floats(1.0, 3.0))
def test_horizon_grows_with_the_threshold(floor, threshold, factor):
    values = np.array(floor)
    first = horizon(values, threshold)
    assert (values[:first] <= threshold).all()
    assert horizon(values, factor * threshold) >= first


def test_the_error_counts_frames_before_the_end_only():
    difference, displacement = np.array([3.0, 4.0, np.inf]), np.array([6.0, 8.0, 1.0])
    assert error_within(difference, displacement, 2) == pytest.approx(0.5)
    assert error_within(difference, displacement, 1) == pytest.approx(0.5)
    assert error_within(difference, displacement, 3) == np.inf
    assert error_within(difference, displacement, 4) is None
    assert error_within(difference, displacement, 0) is None
