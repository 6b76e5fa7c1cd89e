"""Words for scenes and methods."""

from pdrom.reduction.method import load_methods
from places import CONFIG, ROOT
from study.artifact import words
from study.pipeline.scenes import scene_names


def test_every_scene_and_method_of_the_project_has_short_words():
    scenes = {name: words.scene(name) for name in scene_names(ROOT)}
    assert [name for name, found in scenes.items() if len(found) > 30 or "_" in found] == []
    assert [name for name, found in scenes.items() if found == name.replace("_", " ")] == []
    assert [
        name for name in load_methods(CONFIG / "methods.yaml") if name not in words.METHODS
    ] == []


def test_unknown_names_become_words():
    assert words.scene("my_own_scene") == "my own scene"
    assert words.scene("bar_twist_twin") == "twisted bar (short)"
    assert words.method("mine") == "mine"
    assert words.method("mine", "my method") == "my method"
    assert words.method("ecsw-3e-02") == words.method("ecsw")
