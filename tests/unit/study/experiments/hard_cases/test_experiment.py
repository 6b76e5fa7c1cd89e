"""The job of the hard cases: both tables, the same bytes twice, and contradictions in the log."""

import logging

import pandas as pd
import pytest

from pdrom.reduction.method import load_methods
from places import ROOT
from study.artifact.paths import File
from study.experiments.hard_cases.experiment import COLUMNS, HardCases, hard_cases

METHODS = {
    name: spec
    for name, spec in load_methods(ROOT / "config" / "methods.yaml").items()
    if name in ("pod", "deim-joint")
}


def make(folder, expectations=ROOT / "config" / "hard_cases.yaml"):
    paths = [folder / name for name in ("hard_cases.csv", "kernel_accuracy.csv")]
    asked = HardCases(cases=("one_triangle", "flat_bending"), matrices=1)
    cases, kernels = (File(str(path), {}) for path in paths)
    hard_cases(
        expectations=expectations,
        meshes=[],
        every_method=METHODS,
        asked=asked,
        cases=cases,
        kernels=kernels,
    )
    return paths


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    return make(tmp_path_factory.mktemp("first"))


def test_tables_have_their_columns(tables):
    assert pd.read_csv(tables[0]).columns.tolist() == COLUMNS


def test_a_failure_is_listed_with_its_reason(tables):
    table = pd.read_csv(tables[0]).set_index(["case", "method"])
    joint = table.loc["one_triangle", "deim-joint"]
    assert (joint.outcome, joint.finite, joint.blowup_frame) == ("singular", False, 0)
    assert "One row serves x, y and z" in joint.why
    assert table.loc["one_triangle", "pod"].outcome == "holds"
    assert pd.isna(table.loc["one_triangle", "pod"].why)
    assert (table.loc["flat_bending"].outcome.iloc[:2] == "nothing to reduce").all()
    assert set(table.index.unique("method")) >= {"pod-full", "pod-ecsw", "skinning-full"}


def test_the_same_bytes_twice(tables, tmp_path):
    for first, second in zip(tables, make(tmp_path), strict=True):
        assert first.read_bytes() == second.read_bytes()


def test_a_failure_that_nothing_expects_is_logged(tmp_path, caplog):
    empty = tmp_path / "hard_cases.yaml"
    empty.write_text("{}", encoding="utf-8")
    with caplog.at_level(logging.WARNING, logger="pdrom"):
        make(tmp_path, empty)
    assert "one_triangle, deim-joint: singular, but no entry expects a failure" in caplog.text
