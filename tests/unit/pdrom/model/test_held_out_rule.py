"""Moved motions of every scene by one rule: each differs, none is another scene."""

import numpy as np
import pytest

from pdrom.model.effects.forces import Gravity
from pdrom.model.held_out import FASTER, MOTIONS, TILT, WIDE_MOTIONS
from pdrom.model.scene import Scene
from places import ROOT
from study.pipeline.scenes import read_scene

SCENES = [path.stem for path in sorted((ROOT / "config" / "scenes").glob("*.yaml"))]


def changed(scene, motion):
    """Kinds of effects that a motion adds or changes."""
    own = scene.effects
    return {effect.effect for effect in scene.heldout_variant(motion).effects if effect not in own}


def test_the_motions_of_the_tables_are_three_of_six():
    assert MOTIONS == ("heldout", "kick", "stiffness") == WIDE_MOTIONS[:3]
    assert len(set(WIDE_MOTIONS)) >= 6


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_has_six_different_motions_of_its_own_length_and_groups(name):
    scene = read_scene(ROOT, name)
    variants = [scene, *map(scene.heldout_variant, WIDE_MOTIONS)]
    assert all(a.effects != b.effects for i, a in enumerate(variants) for b in variants[:i])
    assert all((v.frames, v.groups, v.mesh) == (scene.frames, scene.groups, scene.mesh)
               for v in variants)  # fmt: skip


def test_motions_change_one_thing_or_two():
    scene = read_scene(ROOT, "bar_twist")
    group = set(scene.groups)
    assert changed(scene, "speed") == {"rotate"}
    assert changed(scene, "gravity") == {"gravity"}
    assert changed(scene, "kick_stiffness") == group | {"kick"}
    faster = next(e for e in scene.heldout_variant("speed").effects if e.effect == "rotate")
    assert (faster.degrees, faster.over) == (90.0, FASTER * 100)
    stiff = scene.heldout_variant("stiffness").effects
    assert scene.heldout_variant("kick_stiffness").effects == (
        *stiff, scene.heldout_variant("kick").effects[-1],
    )  # fmt: skip


@pytest.mark.parametrize(("name", "motion"), [("spring_oop", "speed"), ("bend_poke", "gravity")])
def test_a_fast_kick_replaces_a_change_of_what_a_scene_does_not_have(name, motion):
    scene = read_scene(ROOT, name)
    usual = scene.heldout_variant("kick").effects[-1]
    *same, kick = scene.heldout_variant(motion).effects
    assert tuple(same) == scene.effects
    assert (kick.effect, kick.speed) == ("kick", 2.0 * usual.speed)
    assert kick.seed not in (scene.held_out.seed, usual.seed)


@pytest.mark.parametrize("own", [(0.0, -9.81, 0.0), (0.0, 0.0, 9.81), (3.0, -9.0, 1.0)])
def test_gravity_keeps_its_size_and_turns_towards_the_axis_farthest_from_it(own):
    turned = np.array(Gravity.Config(acceleration=own).tilted(TILT, [0, 1]).acceleration)
    size = np.linalg.norm(own)
    assert np.linalg.norm(turned) == pytest.approx(size)
    assert turned @ own == pytest.approx(size**2 * np.cos(np.radians(TILT)))
    assert turned[0] > own[0]
    if own[2] == 0.0:  # a motion in a plane stays in it
        assert turned[2] == 0.0


@pytest.mark.parametrize(("own", "axes"), [((0.0, 0.0, 0.0), [0, 1]), ((0.0, -9.81, 0.0), [1])])
def test_gravity_that_cannot_be_turned_stays(own, axes):
    config = Gravity.Config(acceleration=own)
    assert config.tilted(TILT, axes) == config


@pytest.mark.parametrize("name", ["cloth_all", "starfish_twist"])
def test_schedules_that_follow_each_other_still_do(name):
    """A scene that held a vertex in two places could not be built."""
    scene = read_scene(ROOT, name)
    mesh = scene.mesh.build(ROOT)
    for motion in WIDE_MOTIONS:
        Scene.build(scene.heldout_variant(motion), mesh)
