"""One rule gives every scene its test trajectories, which differ from all other trajectories."""

import numpy as np
import pytest

from pdrom.core.errors import SceneError
from pdrom.model.effects.forces import Gravity
from pdrom.model.held_out import FASTER, MOTIONS, TILTS
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene
from places import ROOT
from study.experiments.references import run_error
from study.pipeline.scenes import read_scene

SCENES = [path.stem for path in sorted((ROOT / "config" / "scenes").glob("*.yaml"))]


def changed(scene, motion):
    """Kinds of effects that a trajectory adds or changes."""
    own = scene.effects
    return {effect.effect for effect in scene.heldout_variant(motion).effects if effect not in own}


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_has_different_trajectories_of_its_length_and_groups(name):
    scene = read_scene(ROOT, name)
    variants = [scene, *map(scene.heldout_variant, MOTIONS)]
    assert all(a.effects != b.effects for i, a in enumerate(variants) for b in variants[:i])
    assert all((v.frames, v.groups, v.mesh) == (scene.frames, scene.groups, scene.mesh)
               for v in variants)  # fmt: skip


def test_each_trajectory_changes_the_effects_that_the_rule_names():
    twist, sheet = read_scene(ROOT, "bar_twist"), read_scene(ROOT, "spring_oop")
    assert changed(twist, "heldout") == {"rotate", "gravity"}
    assert changed(twist, "kick") == {"rotate", "gravity", "kick"}
    assert changed(twist, "stiffness") == {*twist.groups, "rotate", "gravity", "kick"}
    assert changed(sheet, "heldout") == {"translate", "gravity"}
    assert changed(sheet, "kick") == {"gravity", "kick"}
    assert changed(sheet, "stiffness") == {*sheet.groups, "translate", "gravity", "kick"}

    def handle(motion):
        return next(e for e in twist.heldout_variant(motion).effects if e.effect == "rotate")

    assert [(handle(m).degrees, handle(m).over) for m in MOTIONS] == [
        (90.0, 125), (90.0, FASTER * 100), (-90.0, 100)]  # fmt: skip
    carried = [sheet.heldout_variant(m).effects[2].offset for m in ("heldout", "stiffness")]
    assert carried == [(0.5, 0.0, 0.0), (0.0, 0.0, -0.5)]


@pytest.mark.parametrize("name", ["spring_oop", "bar_twist", "strain_stretch_twin"])
def test_replaying_the_training_trajectory_misses_the_test_trajectories(name):
    scene = read_scene(ROOT, name)
    mesh = scene.mesh.build(ROOT)
    training = trajectory(Scene.build(scene, mesh), track_objective=False)
    for motion in MOTIONS:
        run = trajectory(Scene.build(scene.heldout_variant(motion), mesh), track_objective=False)
        assert run_error(training, run) > 0.3


@pytest.mark.parametrize("own", [(0.0, -9.81, 0.0), (0.0, 0.0, 9.81), (3.0, -9.0, 1.0)])
@pytest.mark.parametrize(("degrees", "place"), TILTS.values())
def test_gravity_of_a_test_trajectory_keeps_its_size_and_turns_towards_an_axis(own, degrees, place):
    turned = np.array(Gravity.Config(acceleration=own).tilted(degrees, [0, 1], place).acceleration)
    size = np.linalg.norm(own)
    assert np.linalg.norm(turned) == pytest.approx(size)
    assert turned @ own == pytest.approx(size**2 * np.cos(np.radians(degrees)))
    axis = [a for a in (0, 1) if abs(own[a]) < size][place]
    assert (turned[axis] - own[axis]) * degrees > 0.0
    if own[2] == 0.0:  # a trajectory in a plane stays in it
        assert turned[2] == 0.0


def test_pins_that_share_vertices_are_carried_only_if_they_start_together():
    scene = read_scene(ROOT, "cloth_all_oop")
    mesh, left = scene.mesh.build(ROOT), scene.effects[2]
    front = left.model_copy(update={"select": "front", "until": 50})
    both = scene.model_copy(update={"effects": (*scene.effects, front)})
    Scene.build(both.heldout_variant("heldout"), mesh)
    late = front.model_copy(update={"start": 10})
    apart = scene.model_copy(update={"effects": (*scene.effects, late)})
    with pytest.raises(SceneError, match=r"held by 'translate' and by 'translate'"):
        Scene.build(apart.heldout_variant("heldout"), mesh)


@pytest.mark.parametrize(
    "name", ["spring_oop", "bar_twist", "bend_fall", "cloth_all", "starfish_twist"]
)
def test_further_training_trajectories_are_no_test_trajectories_and_can_be_built(name):
    """Consecutive schedules stay consecutive: no vertex is fixed in two places."""
    scene = read_scene(ROOT, name)
    made = [scene.training_variant(seed) for seed in range(1, 5)]
    variants = [scene, *map(scene.heldout_variant, MOTIONS), *made]
    assert all(a.effects != b.effects for i, a in enumerate(variants) for b in variants[:i])
    assert made[0] == scene.training_variant(1)
    mesh = scene.mesh.build(ROOT)
    for variant in variants:
        Scene.build(variant, mesh)
