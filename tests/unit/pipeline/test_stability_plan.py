"""Sections stability and guard of the configuration, and what the plan makes of them."""

import pytest

from conftest import ROOT
from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml, validate
from pdrom.pipeline.plan import Plan
from pdrom.pipeline.study import Guard, Stability, Study, StudySettings
from pdrom.reduction.local.guard_settings import GuardSettings

STUDY = {"scenes": ["spring_oop", "strain_oop"], "methods": ["deim", "gappy"], "ranks": [6, "full"]}


def plan(**sections) -> Plan:
    return Plan(Study.load(STUDY | sections, ROOT))


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"guard": {"action": "panic"}}, "guard.action = 'panic'"),
        ({"guard": {"margin": -0.1}}, "guard.margin = -0.1"),
        ({"guard": {"extent": 0.5}}, "guard.extent = 0.5"),
        ({"guard": {"rise": float("nan")}}, "guard.rise"),
        ({"guard": {"threshold": 1}}, "unknown key 'guard.threshold'"),
        ({"guard": {"cases": [{"scene": "a", "method": "b"}]}}, "guard.cases"),
        ({"stability": {"time_steps": [0.0]}}, "stability.time_steps"),
        ({"stability": {"stiffness_ratios": [-1.0]}}, "stability.stiffness_ratios"),
        ({"stability": {"min_frames": 50, "max_frames": 40}}, "max_frames = 40: at least"),
        ({"stability": {"left": 1.0}}, "stability.left = 1.0"),
    ],
)
def test_faults_are_named(section, message):
    with pytest.raises(ConfigurationError) as error:
        validate(StudySettings, STUDY | section, "study")
    assert message in str(error.value)


def test_the_guard_alone_has_no_cases():
    """A further case must not rerun what was watched."""
    settings = Guard(action="stop", margin=0.5, cases=[{"scene": "a", "method": "b", "r": 6}])
    assert settings.watching == GuardSettings(action="stop", margin=0.5)


def test_short_runs_are_planned_where_the_study_holds_them():
    chosen = Stability(scenes=("strain_oop", "bar_release"), ranks=(6, 20))
    made = plan(stability=chosen.model_dump())
    assert made.sweeps == ["results/stability/strain_oop.csv"]
    assert made.stability_settings()["ranks"] == [6]
    assert "scenes" not in made.stability_settings()
    assert made.time_steps() == {"spring_oop": 0.016, "strain_oop": 0.016}


def test_cases_are_planned_where_the_study_holds_them():
    cases = [
        {"scene": "strain_oop", "method": "gappy", "r": "full"},
        {"scene": "bar_release", "method": "deim", "r": 6},
        {"scene": "spring_oop", "method": "pod", "r": 6},
        {"scene": "spring_oop", "method": "deim", "r": 20},
        {"scene": "spring_oop", "method": "deim", "r": 6},
    ]
    made = plan(guard={"cases": cases})
    found = [(c["scene"]["name"], c["group"], c["name"], c["r"]) for c in made.guard_cases()]
    assert found == [("strain_oop", "strain", "gappy", "full"), ("spring_oop", "spring", "deim", 6)]
    assert made.guard_files("sampling") == [
        "results/sampling/strain_oop/strain/gappy.h5",
        "results/sampling/spring_oop/spring/deim.h5",
    ]
    assert [len(made.guard_files(kind)) for kind in ("mesh", "fom", "basis")] == [2, 2, 2]


def test_nothing_to_plan_is_no_fault():
    made = plan()
    assert made.sweeps == made.guard_cases() == made.guard_files("mesh") == []


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
    for case in settings.guard.cases:
        assert case.scene in settings.scenes
        assert case.method in settings.methods
        assert case.r in settings.ranks
