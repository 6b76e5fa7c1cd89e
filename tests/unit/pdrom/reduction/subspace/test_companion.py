"""The distance to an auxiliary model estimates the error of a run, if the model is better."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import make_scene
from pdrom.model.metrics import trajectory_error
from pdrom.model.runs.full_order import trajectory
from pdrom.reduction.rerun import displacement_norms
from pdrom.reduction.subspace.companion import (
    CompanionSpec,
    companion_model,
    companion_run,
    estimate,
)
from pdrom.reduction.subspace.model import SubspaceModel, make_columns
from pdrom.reduction.subspace.rerun import rerun_model

EFFECTS = (
    {"effect": "strain", "weight": 1e5},
    {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]},
    {"effect": "pins", "select": "top"},
)


@pytest.fixture
def sheet():
    """A sheet that swings, its run, and the frames that train."""
    scene = make_scene(*EFFECTS, frames=16)
    reference = trajectory(scene, track_objective=False)
    return scene, reference, np.arange(0, 16, 2)


def test_the_estimate_is_near_the_error_of_a_coarse_run(sheet):
    scene, reference, frames = sheet
    training = reference[1:][frames]
    spec = CompanionSpec(modes=6, tolerance=1e-3, frames=8)
    companion = companion_run(scene, companion_model(scene, training, frames, spec))
    coarse = SubspaceModel("skinning", make_columns(scene, training, "skinning", 2))
    run = rerun_model(scene, coarse, reference)
    error = run.error(displacement_norms(reference))
    assert error > 1e-3
    assert estimate(run.positions, companion, 16) == pytest.approx(error, rel=0.5)


def test_a_companion_has_modes_of_both_kinds(sheet):
    scene, reference, frames = sheet
    spec = CompanionSpec(modes=4, tolerance=1e-2, frames=3)
    model = companion_model(scene, reference[1:][frames], frames, spec)
    alone = make_columns(scene, reference[1:][frames], "pod", 4)
    assert model.columns.modes == 8
    coordinates = np.linalg.lstsq(model.columns.B, alone.B, rcond=None)[0]
    np.testing.assert_allclose(model.columns.B @ coordinates, alone.B, atol=1e-9)
    assert 0 < model.elements_evaluated(scene) <= scene.groups[0].elements


def test_nothing_to_compare_gives_no_estimate():
    resting = np.zeros((5, 3, 3))
    assert estimate(resting, resting, 4) is None
    assert estimate(np.ones((1, 3, 3)), np.arange(45.0).reshape(5, 3, 3), 4) is None


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.9))
def test_saturation_bounds_the_effectivity(seed, theta):
    """Companion nearer to the truth than the run by theta: the distance is right to 1 +- theta."""
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.standard_normal((6, 4, 3)), axis=0)
    error = rng.standard_normal(truth.shape)
    error[0] = 0.0
    own = rng.standard_normal(truth.shape)
    own[0] = 0.0
    own *= theta * np.linalg.norm(error) / np.linalg.norm(own)
    companion = truth + own
    found = estimate(truth + error, companion, 5)
    # both relative to the auxiliary model's motion
    unit = np.linalg.norm(companion[1:] - companion[0])
    ratio = found * unit / np.linalg.norm(error)
    assert 1.0 - theta - 1e-9 <= ratio <= 1.0 + theta + 1e-9


def test_only_frames_before_the_horizon_count(rng):
    companion, run = rng.standard_normal((2, 9, 4, 3))
    short = estimate(run[:5], companion, 8)
    assert short == estimate(run, companion, 4)
    difference = np.linalg.norm((run - companion)[1:].reshape(8, -1), axis=1)
    moved = np.linalg.norm((companion[1:] - companion[0]).reshape(8, -1), axis=1)
    assert estimate(run, companion, 8) == pytest.approx(trajectory_error(difference, moved))
