"""Expected failures: what contradicts an entry, and what a faulty file says."""

import pytest
import yaml

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml, validate
from places import ROOT
from study.experiments.hard_cases.expectations import (
    FAILURES,
    Expectation,
    surprise,
)
from study.experiments.hard_cases.experiment import HardCases, hard_cases
from study.pipeline.resolve import Resolver
from study.pipeline.study import Study

ENTRY = Expectation(why="because of something long enough", fails=("torn",), may_fail=("wire",))


@pytest.mark.parametrize(
    ("outcome", "case", "contradicts"),
    [
        ("blow-up", "torn", False), ("holds", "torn", True), ("nothing to reduce", "torn", True),
        ("singular", "wire", False), ("holds", "wire", False),
        ("distorted", "storm", True), ("holds", "storm", False),
    ],
)  # fmt: skip
def test_what_contradicts_an_entry(outcome, case, contradicts):
    assert bool(surprise(outcome, case, ENTRY)) == contradicts


@pytest.mark.parametrize("outcome", FAILURES)
def test_without_an_entry_every_failure_is_a_surprise(outcome):
    assert surprise(outcome, "a", None)
    assert not surprise("holds", "a", None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x: {why: a reason that is long enough, fails: [no_such_case]}", "unknown case"),
        ("x: {why: a reason that is long enough, fails: [torn], may_fail: [torn]}", "listed twice"),
        ("x: {why: short, fails: [torn]}", "why = 'short'"),
        ("x: {fails: [torn]}", "key 'expected.x.why' is missing"),
        ("x: {why: a reason that is long enough, fail: [torn]}", "unknown key 'expected.x.fail'"),
        ("[torn]", "should be a valid dictionary"),
    ],
)
def test_a_faulty_entry_is_named(text, message):
    config = {"expected": yaml.safe_load(text)}
    with pytest.raises(ConfigurationError, match=rf"^a\.yaml: .*{message}"):
        validate(HardCases, config, "a.yaml")


@pytest.mark.parametrize("name", ["no_such_case", "contradiction", "long_run"])
def test_an_unknown_refused_or_slow_case_is_named(name):
    """Only what a reduction can repeat, and in short, may be asked for."""
    config = read_yaml(ROOT / "config" / "tiny.yaml") | {"hard_cases": {"cases": [name]}}
    with pytest.raises(ConfigurationError, match=f"unknown case '{name}' .allowed: bar_plane"):
        Study.load(config, ROOT)


def test_every_method_takes_part_not_only_those_of_the_study():
    study = Study.load(read_yaml(ROOT / "config" / "tiny.yaml"), ROOT)
    asked = Resolver(study, "results").job(hard_cases, {}).settings["every_method"]
    assert set(asked) == set(read_yaml(ROOT / "config" / "methods.yaml"))
    assert set(asked) > set(study.methods)
