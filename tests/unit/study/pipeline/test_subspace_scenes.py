"""Scenes with an effect that no position subspace takes: left out, told, or refused by name."""

import shutil

import pytest
import yaml

from pdrom.core.errors import ConfigurationError
from places import ROOT
from study.artifact import paths
from study.experiments.kit.declaration import experiments
from study.pipeline.contents import labels_of
from study.pipeline.plan import check_live, check_subspaces
from study.pipeline.study import Study

# What only a position subspace has.
INSIDE = (
    paths.SUBSPACES, paths.SUBSPACES_TRAIN, paths.SUBSPACES_HELDOUT, paths.SUBSPACES_SECONDS,
)  # fmt: skip


@pytest.fixture
def root(tmp_path):
    """A project with a scene of its own, in which wind blows."""
    scenes = tmp_path / "config" / "scenes"
    scenes.mkdir(parents=True)
    files = ("methods.yaml", "scenes/spring_oop.yaml")
    for name in files:
        shutil.copy(ROOT / "config" / name, tmp_path / "config" / name)
    scene = yaml.safe_load((scenes / "spring_oop.yaml").read_text())
    scene["name"] = "windy"
    scene["effects"].append({"effect": "wind", "velocity": [1.0, 0.0, 0.0]})
    (scenes / "windy.yaml").write_text(yaml.safe_dump(scene))
    return tmp_path


def study(root, **sections) -> Study:
    base = {"scenes": ["spring_oop", "windy"], "methods": ["deim"], "ranks": [6]}
    return Study.load(base | sections, root)


@pytest.mark.parametrize("place", INSIDE)
def test_what_no_subspace_takes_has_nothing_of_a_subspace(root, place):
    assert labels_of(study(root), place) == [{"scene": "spring_oop"}]


def test_everything_else_is_held(root):
    held = study(root)
    without = {
        place
        for experiment in experiments().values()
        for place in experiment.writes.values()
        if {"scene": "spring_oop"} in labels_of(held, place)
        and {"scene": "windy"} not in labels_of(held, place)
    }
    assert without == set(INSIDE)


def test_one_line_says_what_the_scene_goes_without(root, caplog):
    check_subspaces(study(root))
    assert caplog.messages == ["windy: no position subspaces, since none takes the effect 'wind'"]
    caplog.clear()
    check_subspaces(study(root, scenes=["spring_oop"]))
    assert caplog.messages == []


@pytest.mark.parametrize(
    ("key", "section"),
    [
        ("subspace.scenes", {"subspace": {"scenes": ["windy"]}}),
        ("scaling.scenes", {"scaling": {"scenes": {"windy": [1.0]}}}),
        ("online.scenes", {"online": {"scenes": ["windy"]}}),
        ("alternatives.scenes", {"alternatives": {"scenes": {"windy": [1.0]}}}),
    ],
)
def test_where_a_subspace_is_asked_for_the_scene_is_refused(root, key, section):
    with pytest.raises(ConfigurationError, match=rf"{key}: scene 'windy' has the effect 'wind'"):
        check_subspaces(study(root, **section))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"anderson_window": 3}, "anderson_window = 3: the page's engine has no acceleration"),
        ({"effects": [{"effect": "bending", "weight": 1.0}], "reduce": {}}, "has no 'bending'"),
        ({"mesh": {"kind": "cloth", "rows": 150, "columns": 150}}, r"7.9 MB .* allowed are 3.0"),
    ],
)
def test_a_scene_that_the_page_cannot_hold_is_refused_by_the_plan(root, changes, words):
    path = root / "config" / "scenes" / "spring_oop.yaml"
    check_live(study(root, live={"scenes": ["spring_oop"]}))
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | changes))
    check_live(study(root, live={"scenes": []}))
    with pytest.raises(ConfigurationError, match=f"^live.scenes: scene 'spring_oop'.*{words}"):
        check_live(study(root, live={"scenes": ["spring_oop"]}))
