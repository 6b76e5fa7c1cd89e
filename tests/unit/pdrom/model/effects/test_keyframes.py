"""Keyframes: poses are met at their frames, between them and after a change of speed."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders import make_scene
from pdrom.model.runs import trajectory

SPRING = {"effect": "spring", "weight": 1e4}
KEYS = [
    {"at": 4, "offset": [0.1, 0.2, 0.0]},
    {"at": 10, "offset": [0.1, 0.0, 0.3], "turn": [0, 90, 0]},
    {"at": 12, "offset": [0.0, 0.0, 0.3], "turn": [0, 450, 0]},
]


def handle(**changes):
    effect = {"effect": "keyframes", "select": "top", "keys": KEYS, **changes}
    return make_scene(SPRING, effect, frames=20)


def posed(points, offset, turn=(0, 0, 0)):
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return middle + Rotation.from_rotvec(turn, degrees=True).apply(points - middle) + offset


@pytest.mark.parametrize("interpolation", ["linear", "smooth"])
@pytest.mark.parametrize("start", [0, 3])
def test_every_key_is_met(interpolation, start):
    scene = handle(interpolation=interpolation, start=start)
    run = trajectory(scene)
    held = scene.boundaries[0].vertices
    taken = run[start, held]
    for key in KEYS:
        expected = posed(taken, key["offset"], key.get("turn", (0, 0, 0)))
        assert run[start + key["at"], held] == pytest.approx(expected, abs=1e-12)
    # a turn of 450 degrees is one of 90, but the way there is not
    assert run[-1, held] == pytest.approx(posed(taken, [0, 0, 0.3], [0, 90, 0]), abs=1e-12)
    if interpolation == "linear":
        halfway = posed(taken, [0.05, 0, 0.3], [0, 270, 0])
        assert run[start + 11, held] == pytest.approx(halfway, abs=1e-12)


def test_smooth_has_no_kink_and_no_overshoot():
    keys = [{"at": 10, "offset": [0, 1, 0]}, {"at": 20, "offset": [0, 1, 0]}]
    scene = handle(keys=keys, interpolation="smooth")
    (boundary,) = scene.boundaries
    start = scene.mesh.points[boundary.vertices]
    path = np.array([boundary.targets(f, start)[0, 1] - start[0, 1] for f in range(20)])
    assert (np.diff(path) >= 0.0).all()
    assert path.max() <= 1.0
    assert np.abs(np.diff(path, 2)).max() < 0.04  # linear: 0.1


def test_another_speed_and_direction():
    (effect,) = (e for e in handle(start=4, until=18).config.effects if e.effect == "keyframes")
    slow = effect.with_frames_scaled(2.5)
    assert ([key.at for key in slow.keys], slow.start, slow.until) == ([10, 25, 30], 10, 45)
    assert [key.at for key in effect.with_frames_scaled(0.1).keys] == [1, 2, 3]
    back = effect.redirected([0, 1])
    assert back.keys[1].offset == (-0.1, 0.0, -0.3)
    assert back.keys[1].turn == (0.0, -90.0, 0.0)
    assert back.redirected([0, 1]) == effect
