"""No frame of a safeguarded interpolation raises the sampled objective, right or wrong."""

from dataclasses import replace

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.runs.full_order import trajectory
from pdrom.reduction.subspace.interpolated import Training, interpolate
from pdrom.reduction.subspace.model import SubspaceModel, make_columns
from pdrom.reduction.subspace.rerun import rerun_model
from pdrom.reduction.subspace.specs import InterpolationSpec

EFFECTS = (
    {"effect": "strain", "weight": 1e5},
    {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]},
    {"effect": "pins", "select": "top"},
)
FRAMES = 24
ACCURATE = InterpolationSpec(modes=8, states="visited", oversampling=3, margin=0.1, safeguard=1e-2)


def accurate(scene, columns, trained):
    return interpolate(scene, columns, trained, ACCURATE)


def wrong(scene, columns, trained):
    """Coefficients thirty times too large, without bounds."""
    return {
        name: replace(own, operator=30.0 * own.operator, lower=None, upper=None)
        for name, own in accurate(scene, columns, trained).items()
    }


@pytest.fixture(scope="module")
def sheet():
    """A sheet that swings, its run, its subspace, and what trains interpolations there."""
    scene = make_scene(*EFFECTS, frames=FRAMES)
    reference = trajectory(scene, track_objective=False)
    training = reference[1::2]
    columns = make_columns(scene, training, "pod", 6)
    return scene, reference, columns, Training(scene, columns, training)


def objectives(scene, columns, found):
    """Sampled objective at the beginning and at the end of every frame (F, 2), and the loop."""
    loop, state = SubspaceModel("pod", columns, found).loop(scene)
    reports = []
    for frame in range(FRAMES):
        state, report = loop.step(state, frame)
        reports.append(report.objective)
    return np.array(reports), loop


@pytest.mark.parametrize("make", [accurate, wrong])
def test_no_frame_raises_the_sampled_objective(sheet, make):
    scene, _, columns, trained = sheet
    found, _ = objectives(scene, columns, make(scene, columns, trained))
    assert found.shape == (FRAMES, 2)
    assert (found[:, 1] <= found[:, 0] + 1e-12 * found.max()).all()


def test_an_accurate_interpolation_is_left_alone(sheet):
    """Only at rest, where the objective is zero, any error raises it."""
    scene, reference, columns, trained = sheet
    safe = accurate(scene, columns, trained)
    alone = {name: replace(own, control=None, control_factors=None) for name, own in safe.items()}
    runs = [
        rerun_model(scene, SubspaceModel("pod", columns, found), reference)
        for found in (safe, alone)
    ]
    assert runs[0].fallbacks <= FRAMES // 4
    errors = [np.linalg.norm(run.difference) for run in runs]
    assert errors[0] <= 1.1 * errors[1]


def test_a_wrong_interpolation_falls_back_and_stays(sheet):
    """Alone it leaves the scene; its repeated frames are those of energy-conserving sampling."""
    scene, reference, columns, trained = sheet
    safe = wrong(scene, columns, trained)
    alone = {name: replace(own, control=None, control_factors=None) for name, own in safe.items()}
    guarded = rerun_model(scene, SubspaceModel("pod", columns, safe), reference)
    free = rerun_model(scene, SubspaceModel("pod", columns, alone), reference)
    assert guarded.fallbacks > 0
    assert guarded.finite
    assert guarded.max_extent < 1.5
    assert not free.finite or free.max_extent > 10.0
