"""The job of the hard cases: the same bytes twice, and contradictions in the log."""

import logging

import pandas as pd
import pytest

from pdrom.core.yamlfile import read_yaml
from pdrom.reduction.method import load_methods
from places import ROOT
from study.artifact.paths import File
from study.experiments.hard_cases.experiment import COLUMNS, HardCases, hard_cases

METHODS = {
    name: spec
    for name, spec in load_methods(ROOT / "config" / "methods.yaml").items()
    if name in ("pod", "deim-joint")
}


EXPECTED = read_yaml(ROOT / "config" / "default.yaml")["hard_cases"]["expected"]


def make(folder, expected=EXPECTED):
    path = folder / "hard_cases.csv"
    asked = HardCases(cases=("one_triangle", "flat_bending"), expected=expected)
    hard_cases(
        meshes=[],
        every_method=METHODS,
        asked=asked,
        cases=File(str(path), {}),
    )
    return path


@pytest.fixture(scope="module")
def table_file(tmp_path_factory):
    return make(tmp_path_factory.mktemp("first"))


def test_the_table_has_its_columns(table_file):
    assert pd.read_csv(table_file).columns.tolist() == COLUMNS


def test_a_failure_is_listed_with_its_reason(table_file):
    table = pd.read_csv(table_file).set_index(["case", "method"])
    joint = table.loc["one_triangle", "deim-joint"]
    assert (joint.outcome, joint.finite, joint.blowup_frame) == ("singular", False, 0)
    assert "One row serves x, y and z" in joint.why
    assert table.loc["one_triangle", "pod"].outcome == "holds"
    assert pd.isna(table.loc["one_triangle", "pod"].why)
    assert (table.loc["flat_bending"].outcome.iloc[:2] == "nothing to reduce").all()
    assert set(table.index.unique("method")) >= {"pod-full", "pod-ecsw", "skinning-full"}


def test_the_same_bytes_twice(table_file, tmp_path):
    assert table_file.read_bytes() == make(tmp_path).read_bytes()


def test_a_failure_that_nothing_expects_is_logged(tmp_path, caplog):
    with caplog.at_level(logging.WARNING, logger="pdrom"):
        make(tmp_path, {})
    assert "one_triangle, deim-joint: singular, but no entry expects a failure" in caplog.text
