"""Settings of a study: its defaults, and section stability with the jobs that come of it."""

from collections.abc import Iterator
from typing import Any

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml, validate
from places import CONFIG, ROOT
from study.artifact import paths
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


def test_short_runs_are_planned_where_the_study_holds_them():
    asked = {"scenes": ["strain_oop", "bar_release"], "ranks": [6, 20]}
    made = study(stability=asked)
    assert labels_of(made, paths.STABILITY) == [{"scene": "strain_oop"}]
    job = Resolver(made, "results").job(stability, {"scene": "strain_oop"})
    plain = job.settings["short"]
    assert plain["ranks"] == [6]
    # which scenes have short runs and how they are judged makes no run again
    assert not {"scenes", "wrong", "left", "departure"} & set(plain)


def test_nothing_to_plan_is_no_fault():
    assert labels_of(study(), paths.STABILITY) == []


@pytest.mark.parametrize("name", ["default", "tiny"])
def test_the_configurations_hold_what_they_ask_for(name):
    """Nothing in these two files is left out without a word."""
    config = read_yaml(CONFIG / "default.yaml")
    if name == "tiny":
        tiny = read_yaml(CONFIG / "tiny.yaml")
        config |= tiny | {"stability": config["stability"] | tiny.get("stability", {})}
    settings = validate(StudySettings, config, name)
    assert set(settings.stability.scenes) <= set(settings.scenes)
    assert set(settings.stability.ranks) <= set(settings.ranks)


# scenes and methods have no default
GIVEN = {"scenes", "methods"}


def defaults() -> dict[str, Any]:
    study = StudySettings(scenes=["spring_oop"], methods=["pod"])
    return study.model_dump(mode="json", by_alias=True, exclude=GIVEN)


def given(content: dict[str, Any], known: Any) -> Iterator[tuple[str, Any, Any]]:
    """(key, value, default) of every value that a configuration gives, inside sections too."""
    for key, value in content.items():
        default = known.get(key) if isinstance(known, dict) else None
        if isinstance(value, dict) and isinstance(default, dict) and default:
            for inner, *rest in given(value, default):
                yield f"{key}.{inner}", *rest
        else:
            yield key, value, default


def test_the_study_repeats_no_default() -> None:
    content = read_yaml(CONFIG / "default.yaml")
    repeated = [key for key, value, default in given(content, defaults()) if value == default]
    assert repeated == []


@pytest.mark.parametrize(("key", "value"), [("sweep", 10), ("timing", 10), ("stability", 120)])
def test_what_the_study_was_made_with(key: str, value: int) -> None:
    """Values that the code once had differently from the file."""
    assert value in defaults()[key].values()
