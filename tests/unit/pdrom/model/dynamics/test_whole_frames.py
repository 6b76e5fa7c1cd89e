"""Frames in compiled code equal those of the Python loop bit for bit."""

import numpy as np
import pytest

from builders import GROUPS, TOP, make_scene
from pdrom.model.dynamics.stepper import Stepper
from pdrom.model.scene import Scene
from places import ROOT
from study.pipeline.scenes import Coarsen, read_scene, scene_names

SPRING = {"effect": "spring", "weight": 1e5}
STRAIN = {"effect": "strain", "weight": 1e5}
FALL = {"effect": "gravity", "acceleration": [0.0, -200.0, 1.0]}
FLOOR = {"effect": "floor", "height": -0.1}
MOVED = {"effect": "translate", "select": "bottom", "start": 5, "over": 4, "offset": [1, 0, 0]}
OWN = {
    "floor": [SPRING, FALL, FLOOR],
    "held in the floor": [
        SPRING, FALL, {**FLOOR, "height": 0.1}, {"effect": "pins", "select": "bottom"},
    ],
    "drag and damping": [
        SPRING, FALL, {"effect": "drag", "coefficient": 3.0}, {"effect": "damping", "rate": 2.0},
    ],
    "taken hold of on the way": [STRAIN, FALL, {**TOP, "until": 7}, MOVED],
    "poke": [SPRING, {"effect": "poke", "over": 4, "rest": 0, "count": 3}],
    "accelerated": [STRAIN, FALL, TOP],
    "bar": [{"effect": "tetrahedron_strain", "weight": 1e6}, FALL],
    "plane": [SPRING, FALL, {"effect": "plane"}],
    "bending": [{"effect": "bending", "weight": 1.0}, FALL],
    "wind": [SPRING, {"effect": "wind", "velocity": [3.0, 0.0, 1.0]}],
}  # fmt: skip
SETTINGS = {
    "accelerated": {"anderson_window": 3},
    "bar": {"mesh": GROUPS["tetrahedron_strain"]},
    "bending": {"mesh": GROUPS["bending"]},
}


def own(name: str) -> Scene:
    return make_scene(*OWN[name], **SETTINGS.get(name, {}))


def assert_same(scene: Scene, loop: Stepper) -> None:
    """Compare the frames of ``loop`` with those of a loop whose observer keeps it in Python."""
    plain = scene.stepper()
    state, frames = scene.initial_state(), range(scene.config.frames)
    for frame, (found, report) in zip(frames, loop.run(state, frames), strict=True):
        state, expected = plain.step(state, frame, lambda y: None)
        np.testing.assert_array_equal(found.positions, state.positions)
        np.testing.assert_array_equal(found.velocities, state.velocities)
        np.testing.assert_array_equal(report.objective, expected.objective)
        assert (report.seconds[1:] > 0.0).all()


@pytest.mark.parametrize("name", OWN)
def test_frames_computed_at_once_equal_those_of_the_loop_and_need_few_calls(name):
    """One compiled call computes many frames if no Python code is needed between them."""
    loop, calls = own(name).stepper(), []
    whole = loop._whole
    assert (whole is None) == (name in ("plane", "bending", "wind"))

    class Counted:
        def run(self, q, v, frames, *rest):
            calls.append(frames.start)
            return whole.run(q, v, frames, *rest)

    loop._whole = whole and Counted()
    assert_same(own(name), loop)
    ends = {"taken hold of on the way": [0, 5, 7], "poke": [0, 4, 8, 12]}
    assert calls == (ends.get(name, [0, 16]) if whole else [])


@pytest.mark.parametrize("name", scene_names(ROOT))
def test_scenes_of_the_study_have_the_same_frames_in_compiled_code(name):
    config = read_scene(ROOT, name, Coarsen(resolution=0.15, frames=0.3))
    scene, other = (Scene.build(config, config.mesh.build(ROOT)) for _ in range(2))
    assert_same(scene, other.stepper())
