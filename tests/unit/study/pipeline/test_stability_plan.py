"""Sections stability and guard of the configuration, and the jobs that come of them."""

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml, validate
from pdrom.reduction.local.guard_settings import GuardSettings
from places import ROOT
from study.artifact import paths
from study.experiments.guard import GuardSection, guard
from study.experiments.reruns import reruns
from study.experiments.stability import stability
from study.pipeline.contents import labels_of
from study.pipeline.resolve import Resolver
from study.pipeline.study import Study, StudySettings

STUDY = {"scenes": ["spring_oop", "strain_oop"], "methods": ["deim", "gappy"], "ranks": [6, "full"]}


def study(**sections) -> Study:
    return Study.load(STUDY | sections, ROOT)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"guard": {"action": "panic"}}, "guard.action = 'panic'"),
        ({"guard": {"margin": -0.1}}, "guard.margin = -0.1"),
        ({"guard": {"extent": 0.5}}, "guard.extent = 0.5"),
        ({"guard": {"rise": float("nan")}}, "guard.rise"),
        ({"guard": {"limit": 1}}, "unknown key 'guard.limit'"),
        ({"guard": {"threshold": -1}}, "guard.threshold = -1"),
        ({"guard": {"alarm": "bell"}}, "guard.alarm = 'bell'"),
        ({"guard": {"cases": [{"scene": "a", "method": "b"}]}}, "guard.cases"),
        ({"stability": {"time_steps": [0.0]}}, "stability.time_steps"),
        ({"stability": {"stiffness_ratios": [-1.0]}}, "stability.stiffness_ratios"),
        ({"stability": {"min_frames": 50, "max_frames": 40}}, "max_frames = 40: at least"),
        ({"stability": {"left": 1.0}}, "stability.left = 1.0"),
        ({"stability": {"departure": 3.0}}, "unknown key 'stability.departure'"),
    ],
)
def test_faults_are_named(section, message):
    with pytest.raises(ConfigurationError) as error:
        validate(StudySettings, STUDY | section, "study")
    assert message in str(error.value)


def test_reruns_depend_on_the_guard_but_not_on_its_cases():
    """A further case must not rerun what was watched."""
    cases = [{"scene": "strain_oop", "method": "deim", "r": 6}]
    made = Resolver(study(guard={"action": "stop", "margin": 0.5, "cases": cases}), "results")
    labels = {"scene": "strain_oop", "group": "strain", "method": "deim"}
    plain = made.job(reruns, labels).settings["settings"]["guard"]
    assert plain == GuardSettings(action="stop", margin=0.5).model_dump(mode="json")


@pytest.mark.parametrize(
    ("asked", "companions"),
    [
        ({"alarm": "estimate", "action": "stop"}, ["results/companion/strain_oop.h5"]),
        ({"alarm": "estimate", "action": "none"}, []),
        ({"alarm": "trained-range"}, []),
    ],
)
def test_reruns_wait_for_the_companion_where_it_gives_the_alarm(asked, companions):
    labels = {"scene": "strain_oop", "group": "strain", "method": "deim"}
    made = Resolver(study(guard=asked), "results").job(reruns, labels)
    assert made.inputs["companions"] == companions


def test_short_runs_are_planned_where_the_study_holds_them():
    asked = {"scenes": ["strain_oop", "bar_release"], "ranks": [6, 20]}
    made = study(stability=asked)
    assert labels_of(made, paths.STABILITY) == [{"scene": "strain_oop"}]
    job = Resolver(made, "results").job(stability, {"scene": "strain_oop"})
    plain = job.settings["short"]
    assert plain["ranks"] == [6]
    # which scenes have short runs and how they are judged makes no run again
    assert not {"scenes", "wrong", "left", "departure"} & set(plain)


def test_cases_are_planned_where_the_study_holds_them():
    cases = [
        {"scene": "strain_oop", "method": "gappy", "r": "full"},
        {"scene": "bar_release", "method": "deim", "r": 6},
        {"scene": "spring_oop", "method": "pod", "r": 6},
        {"scene": "spring_oop", "method": "deim", "r": 20},
        {"scene": "spring_oop", "method": "deim", "r": 6},
    ]
    job = Resolver(study(guard={"cases": cases}), "elsewhere").job(guard, {})
    trials = job.settings["settings"]["trials"]
    found = [(t["scene"]["name"], t["group"], t["name"], t["r"]) for t in trials]
    assert found == [("strain_oop", "strain", "gappy", "full"), ("spring_oop", "spring", "deim", 6)]
    assert job.inputs["samplings"] == [
        "elsewhere/sampling/strain_oop/strain/gappy.h5",
        "elsewhere/sampling/spring_oop/spring/deim.h5",
    ]
    assert [len(files) for files in job.inputs.values()] == [2] * 5


def test_nothing_to_plan_is_no_fault():
    made = study()
    assert labels_of(made, paths.STABILITY) == []
    job = Resolver(made, "results").job(guard, {})
    assert all(files == [] for files in job.inputs.values())


@pytest.mark.parametrize("name", ["default", "tiny"])
def test_the_configurations_hold_what_they_ask_for(name):
    """Nothing in these two files is left out without a word."""
    config = read_yaml(ROOT / "config" / "default.yaml")
    if name == "tiny":
        tiny = read_yaml(ROOT / "config" / "tiny.yaml")
        merge = ("stability", "guard")
        config |= {k: {**config.get(k, {}), **v} if k in merge else v for k, v in tiny.items()}
    settings = validate(StudySettings, config, name)
    assert set(settings.stability.scenes) <= set(settings.scenes)
    assert set(settings.stability.ranks) <= set(settings.ranks)
    assert isinstance(settings.guard, GuardSection)
    for case in settings.guard.cases:
        assert case.scene in settings.scenes
        assert case.method in settings.methods
        assert case.r in settings.ranks
