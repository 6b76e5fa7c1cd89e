"""Runs that continue another run, and uniform initial velocities."""

import h5py
import numpy as np
import pytest

from builders import GRAVITY, GROUPS
from pdrom import api
from pdrom.core.errors import ConfigurationError

VELOCITY = {"effect": "velocity", "value": [1.0, -0.5, 0.25]}
SPRING = {"effect": "spring", "weight": 1e4}
HANDLE = {"effect": "translate", "select": "y_max", "offset": [0, 0.1, 0.3], "over": 9, "start": 2}
ENDING = {"effect": "pins", "select": "y_min", "until": 14}
BALL = {"effect": "sphere", "centre": [0, -0.5, 0], "radius": 0.6, "friction": 0.3}


def scene(*effects, **keys):
    return api.build_scene(effects=effects, **{"mesh": GROUPS["spring"], "frames": 16} | keys)


def test_a_uniform_velocity_gives_the_closed_formula_of_free_flight():
    """q0 + n h v + n (n + 1) / 2 h^2 g after n frames, without deformation."""
    positions = api.run(scene(GRAVITY, VELOCITY, SPRING)).positions
    n, h = np.arange(17.0)[:, None], 0.016
    flight = n * h * np.array(VELOCITY["value"]) + n * (n + 1) / 2 * h**2 * np.array([0, -9.81, 0])
    assert np.abs(positions - positions[0] - flight[:, None]).max() < 1e-12


@pytest.mark.parametrize("group", ["spring", "strain", "bending", "deformation_gradient"])
def test_a_continued_run_equals_the_uninterrupted_run_bit_for_bit(group, tmp_path):
    """With vertices fixed across the break, contacts and forces; also from the file of a run."""
    effects = GRAVITY, VELOCITY, HANDLE, ENDING, BALL, {"effect": group, "weight": 1e4}
    keys = {"mesh": GROUPS[group], "anderson_window": 3 * (group == "spring")}
    whole = api.run(scene(*effects, **keys), tmp_path / "whole.h5")
    half = api.run(scene(*effects, **keys, frames=8))
    for start, frame in ((half, None), (api.load(tmp_path / "whole.h5"), 5)):
        found = api.run(whole.scene, tmp_path / "rest.h5", start=start, frame=frame)
        assert np.array_equal(found.positions, whole.positions)
        assert (found.method, found.snapshots[group].frames[0]) == (whole.method, (frame or 7) + 1)
        with h5py.File(tmp_path / "whole.h5") as one, h5py.File(tmp_path / "rest.h5") as other:
            assert np.array_equal(one["velocities"], other["velocities"])
    assert np.allclose(api.load(tmp_path / "rest.h5").ms[:5], whole.ms[:5], rtol=1e-12)


def test_a_run_of_another_scene_continues_a_run_and_records_it(tmp_path):
    """Vertices that the first run did not fix are fixed at their current positions."""
    first, own = api.run(scene(GRAVITY, VELOCITY, SPRING)), scene(SPRING, ENDING)
    found, bottom = api.run(own, start=first, frame=6), own.boundaries[0].vertices
    assert np.array_equal(found.positions[:7], first.positions[:7])
    assert (found.positions[7:14, bottom] == first.positions[6, bottom]).all()
    again = api.run(own, tmp_path / "a.h5", start=found, frame=9)  # pins do not return to rest
    assert np.array_equal(again.positions, found.positions)
    assert api.load(tmp_path / "a.h5").title.endswith(f"by continuing {found.title}, frame 9")
    with pytest.raises(ConfigurationError, match="training needs complete full-order runs"):
        api.train(found)


def test_a_run_is_continued_only_on_the_same_mesh_and_from_one_of_its_frames():
    first, longer = api.run(scene(SPRING)), {"frames": 20}
    points, triangles = first.scene.mesh.points, first.scene.mesh.triangles
    for words, keys, frame in (
        ("other points", {"mesh": (points + 1e-9, triangles)}, 3),
        ("other triangles", {"mesh": (points, triangles[:, [1, 2, 0]])}, 3),
        (r"other time_step \(0.01\) than the run \(0.016\)", {"time_step": 0.01}, 3),
        ("frame = 17: allowed are 1 to 16", longer, 17),
        ("frame = 0: allowed are 1 to 16", longer, 0),
        ("frame = 16: allowed are 1 to 15", {}, None),
        ("frame = 1: .* frames = 1", {"frames": 1}, 1),
    ):
        with pytest.raises(ConfigurationError, match=words):
            api.run(scene(SPRING, **keys), start=first, frame=frame)


@pytest.mark.parametrize(
    ("effect", "words"),
    [(HANDLE, "'translate' begins before frame 5, .* would jump; set start: 5"),
     ({"effect": "poke", "over": 8, "count": 1}, "'poke' begins before frame 5"),
     (VELOCITY, "'velocity' acts at frame 0 only, .* remove it")],
)  # fmt: skip
def test_a_prescribed_motion_that_begins_before_the_continued_frame_is_refused(effect, words):
    first = api.run(scene(SPRING, {**HANDLE, "offset": [0, 0, 1]}))
    with pytest.raises(ConfigurationError, match=words):
        api.run(scene(SPRING, effect), start=first, frame=5)
