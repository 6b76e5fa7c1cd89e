"""Expected failures: what contradicts an entry, and what a faulty file says."""

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml
from places import ROOT
from study.experiments.hard_cases.expectations import (
    FAILURES,
    Expectation,
    load_expectations,
    surprise,
)
from study.experiments.hard_cases.experiment import hard_cases
from study.pipeline.resolve import Resolver
from study.pipeline.study import Study

ENTRY = Expectation(why="because of something that is long enough", fails=("a",), may_fail=("b",))


@pytest.mark.parametrize(
    ("outcome", "case", "contradicts"),
    [
        ("blow-up", "a", False), ("holds", "a", True), ("nothing to reduce", "a", True),
        ("singular", "b", False), ("holds", "b", False),
        ("distorted", "c", True), ("holds", "c", False),
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
        ("x: {fails: [torn]}", "key 'why' is missing"),
        ("x: {why: a reason that is long enough, fail: [torn]}", "unknown key 'fail'"),
        ("[torn]", "a mapping of reductions"),
    ],
)
def test_a_faulty_file_is_named(tmp_path, text, message):
    path = tmp_path / "hard_cases.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match=message) as error:
        load_expectations(path)
    assert str(path) in str(error.value)


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
