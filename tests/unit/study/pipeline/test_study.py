"""Studies: settings, defaults, derived scenes, and scenes that no subspace accepts."""

import pytest
import yaml

from bad_input.project import make_project
from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml, validate
from places import CONFIG, ROOT
from study.artifact import paths
from study.experiments.kit.base import experiments
from study.experiments.stability import stability
from study.pipeline.plan import Plan, check_live, check_subspaces
from study.pipeline.study import Study, StudySettings, labels_of

STUDY = {"scenes": ["spring_oop", "strain_oop"], "methods": ["deim", "gappy"], "ranks": [6, "full"]}


def study(**sections) -> Study:
    return Study(STUDY | sections, ROOT)


def test_short_runs_are_planned_for_the_scenes_that_the_study_lists():
    asked = {"scenes": ["strain_oop", "bar_release"], "ranks": [6, 20]}
    made = study(stability=asked)
    assert labels_of(made, paths.STABILITY) == [{"scene": "strain_oop"}]
    job = Plan(made).job(stability, {"scene": "strain_oop"})
    plain = job.settings["short"]
    assert plain["ranks"] == [6]
    # the choice of scenes with short runs, and their limits, rerun nothing
    assert not {"scenes", "wrong", "left", "departure"} & set(plain)
    assert labels_of(study(), paths.STABILITY) == []


def test_alternatives_run_on_small_and_on_large_scenes_of_the_study():
    scenes = {"bar_release": [1], "strain_oop": [1, 2], "torus_release": [1]}
    made = study(alternatives={"scenes": scenes}, online={"scenes": ["torus_release"]})
    asked = [(run["scene"], run["factor"]) for run in labels_of(made, paths.ALTERNATIVES)]
    assert asked == [("strain_oop", "1"), ("strain_oop", "2"), ("torus_release", "1")]


@pytest.mark.parametrize("name", ["default", "tiny"])
def test_the_configurations_contain_everything_that_they_request(name):
    config = read_yaml(CONFIG / "default.yaml")
    if name == "tiny":
        tiny = read_yaml(CONFIG / "tiny.yaml")
        config |= tiny | {"stability": config["stability"] | tiny.get("stability", {})}
    settings = validate(StudySettings, config, name)
    assert set(settings.stability.scenes) <= set(settings.scenes)
    assert set(settings.stability.ranks) <= set(settings.ranks)


@pytest.fixture
def root(tmp_path):
    """A project with another scene, in which wind blows."""
    scene = read_yaml(CONFIG / "scenes" / "spring_oop.yaml") | {"name": "windy"}
    scene["effects"].append({"effect": "wind", "velocity": [1.0, 0.0, 0.0]})
    return make_project(tmp_path, {"config/scenes/windy.yaml": yaml.safe_dump(scene)})


def windy(root, **sections) -> Study:
    base = {"scenes": ["spring_oop", "windy"], "methods": ["deim"], "ranks": [6]}
    return Study(base | sections, root)


def test_a_scene_that_no_subspace_accepts_has_all_other_results(root):
    held = windy(root)
    without = {
        place
        for experiment in experiments().values()
        for place in experiment.writes.values()
        if {"scene": "spring_oop"} in labels_of(held, place)
        and {"scene": "windy"} not in labels_of(held, place)
    }
    assert without == {
        paths.SUBSPACES, paths.SUBSPACES_TRAIN, paths.SUBSPACES_HELDOUT, paths.SUBSPACES_SECONDS,
        paths.ERROR_BUDGET,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("key", "scenes"),
    [
        ("subspace", ["windy"]),
        ("scaling", {"windy": [1.0]}),
        ("online", ["windy"]),
        ("alternatives", {"windy": [1.0]}),
    ],
)
def test_a_scene_that_no_subspace_accepts_is_refused_if_a_subspace_is_requested(root, key, scenes):
    with pytest.raises(ConfigurationError, match=rf"{key}.scenes: scene 'windy' has the effect"):
        check_subspaces(windy(root, **{key: {"scenes": scenes}}))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"anderson_window": 3}, "anderson_window = 3: the page's engine has no acceleration"),
        ({"effects": [{"effect": "bending", "weight": 1.0}], "reduce": {}}, "has no 'bending'"),
    ],
)
def test_a_scene_that_the_page_of_models_cannot_show_is_refused_by_the_plan(root, changes, words):
    path = root / "config" / "scenes" / "spring_oop.yaml"
    check_live(windy(root, live={"scenes": ["spring_oop"]}))
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | changes))
    check_live(windy(root, live={"scenes": []}))
    with pytest.raises(ConfigurationError, match=f"^live.scenes: scene 'spring_oop'.*{words}"):
        check_live(windy(root, live={"scenes": ["spring_oop"]}))
