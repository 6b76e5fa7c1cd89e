"""Tables of DEIM constants and trajectories of small reruns, against values by hand."""

import numpy as np
import pandas as pd
import pytest

from builders import frame
from study.tables.errors import gain_interventions
from study.tables.kit.results import KEYS, TRAIN, judged_runs, over_motions, trained, with_held_out

# no error: the run ended before
RUNS = frame(
    "scene method r relative_error gain elements_sampled frames",
    ("calm", "pod", 20, 1e-3, 1.0, 100, 50),
    ("calm", "block-deim", 20, 1e-2, 8.0, 20, 50),
    ("calm", "bounded", 20, 1.4e-3, 2.0, 25, 50),
    ("calm", "deim-joint", 21, None, 500.0, 21, 3),
    ("calm", "deim", 20, 0.5, 50.0, 19, 50),
    ("quiet", "pod", 20, 1e-9, 1.0, 100, 50),
    ("quiet", "bounded", 20, 5e-9, 2.0, 25, 50),
    ("wild", "pod", 20, 1e-2, 1.0, 100, 50),
    ("wild", "deim", 20, 0.2, 9.0, 20, 50),
    ("hopeless", "pod", 20, 0.9, 1.0, 100, 50),
    ("hopeless", "deim", 20, 0.9, 5.0, 20, 50),
)
HORIZONS = {"calm": 50, "quiet": 50, "wild": 30, "hopeless": 50}
FLOORS = {"calm": 1e-8, "quiet": 1e-8, "wild": 1e-3, "hopeless": 1e-8}


def tables() -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tables `reduced_reruns` and `reconstruction_error` with the columns that both tables read."""
    runs = RUNS.assign(group="spring")
    measured = runs.drop(columns="frames")
    splits = (("train", 1e-4 * runs.gain), ("test", 1.0))
    reconstruction = [measured.assign(split=split, relative_error=e) for split, e in splits]
    finite = runs.relative_error.notna()
    runs = runs.drop(columns=["gain", "elements_sampled"]).assign(
        position_basis="full", motion="train", max_extent=1.0, finite=finite,
        blowup_frame=runs.frames.mask(finite), relative_error_within_horizon=runs.relative_error,
        horizon_frame=runs.scene.map(HORIZONS), sensitivity_floor=runs.scene.map(FLOORS),
    )  # fmt: skip
    nothing = dict.fromkeys(("max_extent", "finite", "relative_error_within_horizon"), np.nan)
    marked = runs[:1].assign(r=99, frames=0, **nothing)
    others = (marked, runs[1:2].assign(position_basis="pod"), runs[1:2].assign(motion="kick"))
    return pd.concat([runs, *others], ignore_index=True), pd.concat(reconstruction)


def test_only_runs_with_a_sufficient_basis_count():
    runs = judged_runs(*tables())
    assert set(runs.scene) == {"calm", "quiet", "wild"}
    assert runs.set_index(["scene", "method"]).failed.to_dict() == {
        ("calm", "block-deim"): False, ("calm", "bounded"): False, ("calm", "deim-joint"): True,
        ("calm", "deim"): True, ("quiet", "bounded"): False, ("wild", "deim"): True,
    }  # fmt: skip


def square(*runs: tuple) -> pd.DataFrame:
    """Rows of the two by two ablation: scene, step, rows of an element, constant and error."""
    names = "scene rung rows_per_element gain relative_error_within_horizon"
    return frame(names, *runs).assign(direction="square", group="spring", r=20)


def test_samples_and_coefficients_are_exchanged_at_equal_entries():
    """A scene and its short variant are one family; elements of one row are no other sample."""
    reruns, reconstruction = tables()
    runs = [
        (scene, rung, p, gain, error)
        for scene, p in (("calm", 2), ("calm_twin", 2), ("wild", 1))
        for rung, gain, error in (
            ("single rows, separate", 1000.0, 0.5),
            ("single rows, shared", 50.0, 0.05),
            ("whole elements, separate", 100.0, 0.6),
            ("whole elements, shared", 8.0, 0.05),
            ("three elements, separate", 10.0, 0.3),
            ("three elements, shared", 4.0, 0.02),
        )
    ]
    twins = [t.assign(scene="calm_twin")[t.scene == "calm"] for t in (reruns, reconstruction)]
    both = [pd.concat(two) for two in zip((reruns, reconstruction), twins, strict=True)]
    table = gain_interventions(*both, square(*runs)).query("mesh == 'all'").set_index("step")
    shared = table.loc["shared coefficients, single rows"]
    assert (shared.pairs, shared.scenes, shared.families, shared.families_fallen) == (3, 3, 2, 2)
    assert (shared.gain_ratio, shared.error_ratio, shared.p_value) == (0.05, 0.1, 0.5)
    elements = table.loc["whole elements, separate coefficients"]
    # the constant falls tenfold and the error does not
    assert (elements.pairs, elements.families, elements.unexplained_share) == (2, 1, 1.0)
    # the four cells of coefficients by samples: elements of a single row count, too
    cells = table[["pairs", "failing", "failing_after", "error_before", "error_after"]].loc
    assert cells["shared coefficients, whole elements"].tolist() == [3, 3, 0, 0.6, 0.05]
    assert cells["three elements, separate coefficients"].tolist() == [3, 3, 3, 0.6, 0.3]
    assert cells["three elements, shared coefficients"].tolist() == [3, 0, 0, 0.05, 0.02]
    assert cells["shared coefficients, three elements"].tolist() == [3, 3, 0, 0.3, 0.02]


def test_interventions_compare_runs_with_the_same_basis():
    table = gain_interventions(*tables(), square())
    assert set(table.mesh) == {"all", "sheets"}  # no group of tetrahedra ran
    table = table[table.mesh == "sheets"].set_index("step")
    # block-deim ran in one scene only, with constant and error below those of deim
    step = table.loc["whole elements for single entries"]
    assert (step.pairs, step.scenes, step.families_fallen) == (1, 1, 1)
    assert step.gain_ratio == pytest.approx(8.0 / 50.0)
    assert (step.failing, step.rescued) == (1, 1)  # from 50 % to 1 %
    assert step.error_ratio == step.error_ratio_low == pytest.approx(0.02)
    assert step.p_value == 1.0
    assert "three elements a mode for one" not in table.index


def test_each_scene_counts_once_for_any_number_of_sizes():
    # one error of "u" rises so much that its mean would rise, its median falls
    ratios = {"s": [0.5] * 40, "t": [2.0] * 2, "u": [0.25, 0.25, 9.0], "v": [0.1] * 2, "w": [1, 1]}
    rows = [
        (scene, *row)
        for scene, own in ratios.items()
        for r, ratio in enumerate(own)
        for row in (("pod", r, 1, 1e-3), ("block-deim", r, 8, 1e-2), ("gappy", r, 4, 1e-2 * ratio))
    ]
    runs = frame("scene method r gain relative_error_within_horizon", *rows).assign(
        group="spring", position_basis="full", motion="train", max_extent=1.0, blowup_frame=None,
        sensitivity_floor=1e-8,
    )  # fmt: skip
    read = (runs.drop(columns="gain"), runs.assign(split="train"))
    step, ordered = gain_interventions(*read, square()).query("mesh == 'all'").itertuples()
    assert (step.pairs, step.scenes, step.families_fallen, step.families) == (49, 5, 3, 5)
    # the constant falls everywhere, the error not in the two pairs of t and of w and in one of u
    assert step.unexplained_share == pytest.approx(5 / 49)
    assert (ordered.step, ordered.pairs) == ("lower gain, shared coefficients", 49)
    assert step.error_ratio == 0.5
    # sign test by hand; the tie of "w" counts as no fall: 2 (10 + 5 + 1) / 32
    assert step.p_value == pytest.approx(1.0)
    assert step.error_ratio_low < 0.5 <= step.error_ratio_high


def test_an_error_is_the_median_over_the_trajectories_that_can_be_judged():
    error = "relative_error_within_horizon"
    usual = {
        "scene": "a", "group": "g", "method": "pod", "position_basis": "full", "k": None,
        "motion": "kick", "frames": 9, "blowup_frame": None, "horizon_frame": 9,
        "playback_error": 0.5,
    }  # fmt: skip
    runs = [
        {"r": 6, error: 0.1}, {"r": 6, error: 0.3}, {"r": 6, error: 0.2},
        # ended early; no frame before the horizon; beyond the rank
        {"r": 10, error: None, "frames": 3, "blowup_frame": 3}, {"r": 10, error: 0.5},
        {"r": 10, error: 0.4}, {"r": 10, error: None, "horizon_frame": 0},
        {"r": 20, error: None, "frames": 0},
        # replaying has no error here: no test
        {"r": 6, error: 0.9, "playback_error": 0.3},
        {"r": 6, error: 0.7, "motion": TRAIN}, {"r": 20, error: 0.8, "motion": TRAIN},
    ]  # fmt: skip
    table = pd.DataFrame([usual | run for run in runs])
    table["deformation_error"] = 2.0 * table[error].where(table.playback_error == 0.5)
    found = over_motions(table).set_index("r")
    assert found.loc[6, "error_heldout"] == pytest.approx(0.2)
    assert tuple(found.loc[6, ["error_heldout_low", "error_heldout_high"]]) == (0.1, 0.3)
    assert tuple(found.loc[10, ["error_heldout", "error_heldout_high"]]) == (0.5, np.inf)
    assert found.deformation_heldout.to_dict() == pytest.approx({6: 0.4, 10: 1.0})
    assert found.motions.to_dict() == {6: 3, 10: 3}
    assert found.playback_error.to_dict() == {6: 0.5, 10: 0.5}
    beside = with_held_out(trained(table)[KEYS], table)
    assert beside.error_heldout.isna().tolist() == [False, True]
