"""Hard cases: the table and its settings."""

import pandas as pd
import pytest
import yaml

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml, validate
from pdrom.reduction.method import load_methods
from places import ROOT
from study.artifact.paths import File
from study.experiments.hard_cases import outcomes as module
from study.pipeline.plan import Plan
from study.pipeline.study import Study


def made(folder, expected):
    path = folder / "hard_cases.csv"
    methods = load_methods(ROOT / "config" / "methods.yaml")
    two = {name: methods[name] for name in ("pod", "deim-joint")}
    asked = module.HardCases(cases=("one_triangle", "flat_bending"), expected=expected)
    module.hard_cases(listed=[], every_method=two, asked=asked, out=File(str(path), {}))
    return pd.read_csv(path)


def test_a_failure_is_listed_with_its_reason(tmp_path):
    default = read_yaml(ROOT / "config" / "default.yaml")
    table = made(tmp_path, default["hard_cases"]["expected"])
    assert table.columns.tolist() == module.COLUMNS
    table = table.set_index(["case", "method"])
    joint = table.loc["one_triangle", "deim-joint"]
    assert (joint.outcome, joint.finite, joint.blowup_frame) == ("singular", False, 0)
    assert "x, y and z share one row" in joint.why
    assert table.loc["one_triangle", "pod"].outcome == "holds"
    assert pd.isna(table.loc["one_triangle", "pod"].why)
    assert (table.loc["flat_bending"].outcome.iloc[:2] == "nothing to reduce").all()
    assert set(table.index.unique("method")) >= {"pod-full", "pod-ecsw", "skinning-full"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x: {why: a reason that is long enough, fails: [no_such_case]}",
         "unknown case 'no_such_case' .allowed: bar_plane"),
        ("x: {why: short, fails: [torn]}", "why = 'short'"),
    ],
)  # fmt: skip
def test_a_faulty_entry_of_the_hard_cases_is_named(text, message):
    config = {"expected": yaml.safe_load(text)}
    with pytest.raises(ConfigurationError, match=rf"^a\.yaml: .*{message}"):
        validate(module.HardCases, config, "a.yaml")


def test_every_method_is_run_on_the_hard_cases_not_only_those_of_the_study():
    study = Study(read_yaml(ROOT / "config" / "tiny.yaml"), ROOT)
    asked = Plan(study).job(module.hard_cases, {}).settings["every_method"]
    assert set(asked) == set(read_yaml(ROOT / "config" / "methods.yaml"))
    assert set(asked) > set(study.methods)
