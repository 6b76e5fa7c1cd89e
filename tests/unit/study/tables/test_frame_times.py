"""Times over processes: intervals, controls, and one time for each scene."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom

from builders import frame
from study.experiments.frame_times import COLUMNS
from study.tables.effects_cost import frame_times, online, scaling, speedups, unreliable
from study.tables.errors import repetitions
from study.tables.kit.results import median_interval


def test_the_interval_of_a_median_is_that_of_the_binomial_distribution():
    """The bootstrap's median of odd n is at most the k-th value if n // 2 + 1 draws are."""
    n = 11
    _, low, high = median_interval(np.arange(1.0, n + 1))
    share = binom.sf(n // 2, n, np.arange(1, n + 1) / n)
    assert abs(low - (1 + np.searchsorted(share, 0.025))) <= 1.0
    assert abs(high - (1 + np.searchsorted(share, 0.975))) <= 1.0


@pytest.fixture
def measured() -> pd.DataFrame:
    """Three processes of varying speed: scene a with its short variant and two reductions."""
    full, control = (("full", *5 * [None]), ("control", *5 * [None]))
    runs = frame(
        "scene role group method position_basis k r ms_per_frame",
        ("a", *full, 2.0), ("a", *control, 2.02), ("a_twin", *full, 2.2), ("a_twin", *control, 4.0),
        ("a", "reduced", "all", "ecsw", "pod", 4, 7, 0.5),
        ("a", "reduced", "spring", "deim", "full", None, 6, 4.0),
    ).astype({"k": "Int64", "r": "Int64"})  # fmt: skip
    runs = runs.assign(vertices=9, frames=100, vertices_ms=0.1 * runs.ms_per_frame)
    runs["processor_share"] = 1.0
    times = ["ms_per_frame", "vertices_ms"]
    processes = [
        runs.assign(process=process, **speed * runs[times])
        for process, speed in ((1, 1.0), (2, 2.0), (3, 1.5))
    ]
    return pd.concat(processes)[COLUMNS]


def test_each_scene_has_one_time_and_one_control(measured):
    table = frame_times(measured).set_index("scene")
    assert table.ms_per_frame.to_dict() == {"a": 3.0, "a_twin": pytest.approx(3.3)}
    assert (table.processes == 3).all()
    # the ratios do not depend on the speed of the machine
    assert table.control_ratio["a"] == pytest.approx(1.01)
    assert not table.control_agrees["a"]
    assert table.twin_ratio["a"] == pytest.approx(1.1)
    assert np.isnan(table.twin_ratio["a_twin"])


def test_a_speedup_is_listed_with_its_costs_and_errors(measured):
    models = {"scene": ["a"], "position_basis": ["pod"], "k": [4], "method": ["ecsw"]}
    steps = {"scene": ["a"], "group": ["spring"], "method": ["deim"], "r": [6]}
    files = {"projections": pd.DataFrame({**steps, "reduction_s": [0.1]}), "reruns": None}
    files |= {"subspaces": pd.DataFrame({**models, "reduction_s": [0.15]}), "large": pd.DataFrame()}
    runs = pd.concat([
        pd.DataFrame(models).assign(group="all", r=7, error_converged=0.01),
        pd.DataFrame(steps).assign(position_basis="full", error_converged=0.2),
    ])  # fmt: skip
    unseen = runs[runs.method == "ecsw"].assign(motion="kick")
    runs = pd.concat([runs.assign(motion="train"), unseen])
    runs = runs.assign(deformation_converged=3.0 * runs.error_converged)
    runs = runs.assign(frames=9, blowup_frame=None, horizon_frame=9, playback_error=0.5)
    files["reruns"], times = runs, frame_times(measured)
    for uncertain in (times.assign(control_high=1.6), times.assign(control_low=0.6)):
        assert set(speedups(measured, uncertain, **files).shown) == {"not confirmed by its control"}
    table = speedups(measured, times, **files).set_index("method")
    assert table.speedup.to_dict() == {"ecsw": pytest.approx(4.0), "deim": pytest.approx(0.5)}
    assert table.shown.to_dict() == {"ecsw": "4.0 (4.0 to 4.0)", "deim": "0.50 (0.50 to 0.50)"}
    assert table.vertices_ms.to_dict() == {"ecsw": pytest.approx(0.075), "deim": pytest.approx(0.6)}
    assert table.loses.to_dict() == {"ecsw": False, "deim": True}
    # 100 frames of 3 ms and 0.15 s, paid back by 3 - 0.75 ms a frame
    assert table.training_s["ecsw"] == pytest.approx(0.3)
    assert table.frames_to_break_even["ecsw"] == pytest.approx(450.0 / 2.25)
    assert pd.isna(table.frames_to_break_even["deim"])
    assert table.error_train.to_dict() == {"ecsw": 0.01, "deim": 0.2}
    assert table.deformation_train.to_dict() == pytest.approx({"ecsw": 0.03, "deim": 0.6})
    assert set(table.reference) == {"converged"}
    held = ["error_heldout", "deformation_heldout", "playback_error"]
    assert table.loc["ecsw", held].tolist() == pytest.approx([0.01, 0.03, 0.5])
    assert pd.isna(table.error_heldout["deim"])


@pytest.mark.parametrize("made", [frame_times, speedups, online, repetitions, scaling])
def test_tables_without_input_files_are_empty(made):
    assert made(**dict.fromkeys(made.reads, pd.DataFrame())).empty


def test_repetitions_are_summarised_by_median_and_range():
    errors, gains = [0.2, 0.1, float("inf")], [4.0, 3.0, 5.0]
    rows = pd.DataFrame({"seed": [1, 2, 3], "error": errors, "gain": gains}).assign(
        scene="a", group="spring", method="deim", r=6, varied="training", finite=True
    )
    (row,) = repetitions(rows).itertuples()
    assert (row.repetitions, row.ended) == (3, 1)
    assert (row.error_low, row.error_median, row.error_high) == (0.1, 0.2, np.inf)
    assert (row.gain_low, row.gain_median, row.gain_high) == (3.0, 4.0, 5.0)


@pytest.mark.parametrize(
    ("share", "control", "said"), [(0.98, 1.1, False), (0.7, 1.1, True), (0.98, 1.7, True)]
)
def test_times_are_unreliable_without_a_processor_or_if_controls_differ(share, control, said):
    times = frame("control_low control_high processor_share", (1.0, control, share))
    assert unreliable(times) is said
