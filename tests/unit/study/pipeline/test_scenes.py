"""Scenes that a configuration makes out of others."""

import re

import pytest
from pydantic import ValidationError

from pdrom.core.errors import ConfigurationError
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.scene import Scene, SceneConfig
from places import ROOT
from study.artifact.paths import LABELS
from study.pipeline.scenes import Replicate, Variants, read_scene
from study.pipeline.study import Study

SECTION = Variants(
    scenes=("spring_oop",), resolutions=(0.5, 1.5), stiffness_ratios=(0.01, 1), seeds=(1, 2)
)


def read(name: str) -> SceneConfig:
    return read_scene(ROOT, name)


@pytest.fixture(scope="module")
def made() -> dict[str, SceneConfig]:
    return {scene.name: scene for scene in SECTION.of(read)}


def test_every_combination_has_a_name_that_a_path_takes(made: dict[str, SceneConfig]) -> None:
    assert len(made) == 2 * 2 * 2
    assert "spring_oop_m1p5_w0p01_s2" in made
    assert all(re.fullmatch(LABELS["scene"], name) for name in made)


def test_a_variant_differs_in_mesh_weight_and_start_alone(made: dict[str, SceneConfig]) -> None:
    scene, base = made["spring_oop_m1p5_w0p01_s2"], read("spring_oop")
    assert scene.mesh == base.mesh.coarsened(1.5)
    weights = [e.weight for e in scene.effects if isinstance(e, GroupConfig)]
    before = [e.weight for e in base.effects if isinstance(e, GroupConfig)]
    assert weights == [0.01 * weight for weight in before]
    assert scene.effects[-1].model_dump()["seed"] == 2
    assert len(scene.effects) == len(base.effects) + 1
    same = set(SceneConfig.model_fields) - {"name", "title", "mesh", "effects"}
    assert all(getattr(scene, key) == getattr(base, key) for key in same)


def test_seeds_are_other_starts_of_the_same_motion(made: dict[str, SceneConfig]) -> None:
    pair = [made[f"spring_oop_m0p5_w1_s{seed}"] for seed in (1, 2)]
    mesh = pair[0].mesh.build(ROOT)
    first, second = (Scene.build(scene, mesh).initial_state().velocities for scene in pair)
    assert (first != second).any()


def test_a_study_holds_its_variants_beside_its_scenes() -> None:
    config = {"scenes": ["strain_oop"], "methods": ["deim"], "variants": SECTION.model_dump()}
    study = Study.load({**config, "coarsen": {"resolution": 0.3, "frames": 0.1}}, ROOT)
    assert len(study.scenes) == 1 + 8
    fine, coarse = (study.bound[f"spring_oop_m{m}_w1_s1"].mesh for m in ("1p5", "0p5"))
    assert fine.vertices > coarse.vertices


def test_a_replicated_scene_is_faster_and_starts_elsewhere() -> None:
    change = Replicate(frames_factor=0.8, kick=0.1, seed=100)
    base, scene = read("bar_twist"), read_scene(ROOT, "bar_twist", change)
    turns = [[e.over for e in s.effects if e.effect == "rotate"] for s in (base, scene)]
    assert turns == [[100, 100], [80, 80]]
    assert scene.effects[-1].model_dump() == {
        "effect": "kick", "speed": 0.1, "seed": 100, "axes": ("x", "y", "z"),
    }  # fmt: skip
    assert scene.held_out.seed == base.held_out.seed + 100
    assert (scene.frames, scene.mesh, scene.reduce) == (base.frames, base.mesh, base.reduce)
    starts = [s.effects[-1].seed for s in (scene.heldout_variant("kick"),)]
    assert starts == [102]
    assert read_scene(ROOT, "bar_twist", Replicate()) == base


def test_an_unknown_scene_is_named() -> None:
    config = {"scenes": ["strain_oop"], "methods": ["deim"], "variants": {"scenes": ["spring_oup"]}}
    with pytest.raises(ConfigurationError, match="spring_oup"):
        Study.load(config, ROOT)


def test_an_entry_that_is_given_twice_is_refused() -> None:
    with pytest.raises(ValidationError, match="twice"):
        Variants(seeds=(1, 1))
