"""Hard cases: the table, its settings, contradictions in the log; each check finds its fault."""

import logging
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml, validate
from pdrom.reduction.method import load_methods
from places import ROOT
from study.artifact.paths import File
from study.experiments.hard_cases import outcomes as module
from study.experiments.hard_cases.catalogue import CASES
from study.experiments.hard_cases.record import CHECKS, faults, full_order, record
from study.pipeline.plan import Plan
from study.pipeline.study import Study


def made(folder, expected):
    path = folder / "hard_cases.csv"
    methods = load_methods(ROOT / "config" / "methods.yaml")
    two = {name: methods[name] for name in ("pod", "deim-joint")}
    asked = module.HardCases(cases=("one_triangle", "flat_bending"), expected=expected)
    module.hard_cases(meshes=[], every_method=two, asked=asked, cases=File(str(path), {}))
    return pd.read_csv(path)


def test_a_failure_is_listed_with_its_reason_and_logged_if_nothing_expects_it(tmp_path, caplog):
    with caplog.at_level(logging.WARNING, logger="pdrom"):
        made(tmp_path, {})
    assert "one_triangle, deim-joint: singular, but no entry expects a failure" in caplog.text
    default = read_yaml(ROOT / "config" / "default.yaml")
    table = made(tmp_path, default["hard_cases"]["expected"])
    assert table.columns.tolist() == module.COLUMNS
    table = table.set_index(["case", "method"])
    joint = table.loc["one_triangle", "deim-joint"]
    assert (joint.outcome, joint.finite, joint.blowup_frame) == ("singular", False, 0)
    assert "One row serves x, y and z" in joint.why
    assert table.loc["one_triangle", "pod"].outcome == "holds"
    assert pd.isna(table.loc["one_triangle", "pod"].why)
    assert (table.loc["flat_bending"].outcome.iloc[:2] == "nothing to reduce").all()
    assert set(table.index.unique("method")) >= {"pod-full", "pod-ecsw", "skinning-full"}


ENTRY = module.Expectation(
    why="because of something long enough", fails=("torn",), may_fail=("wire",)
)


@pytest.mark.parametrize(
    ("outcome", "case", "entry", "contradicts"),
    [
        ("blow-up", "torn", ENTRY, False), ("holds", "torn", ENTRY, True),
        ("nothing to reduce", "torn", ENTRY, True),
        ("singular", "wire", ENTRY, False), ("holds", "wire", ENTRY, False),
        ("distorted", "storm", ENTRY, True), ("holds", "storm", ENTRY, False),
        *((failure, "storm", None, True) for failure in module.FAILURES),
        ("holds", "storm", None, False),
    ],
)  # fmt: skip
def test_what_contradicts_an_entry_or_that_there_is_none(outcome, case, entry, contradicts):
    assert bool(module.surprise(outcome, case, entry)) == contradicts


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
        validate(module.HardCases, config, "a.yaml")


@pytest.mark.parametrize("name", ["no_such_case", "contradiction", "long_run"])
def test_an_unknown_refused_or_slow_case_is_named(name):
    """Only what a reduction can repeat, and in short, may be asked for."""
    config = read_yaml(ROOT / "config" / "tiny.yaml") | {"hard_cases": {"cases": [name]}}
    with pytest.raises(ConfigurationError, match=f"unknown case '{name}' .allowed: bar_plane"):
        Study(config, ROOT)


def test_every_method_takes_part_not_only_those_of_the_study():
    study = Study(read_yaml(ROOT / "config" / "tiny.yaml"), ROOT)
    asked = Plan(study).job(module.hard_cases, {}).settings["every_method"]
    assert set(asked) == set(read_yaml(ROOT / "config" / "methods.yaml"))
    assert set(asked) > set(study.methods)


CASE = CASES["inverted_uneven"]


@pytest.fixture(scope="module")
def scene():
    return CASE.scene()


@pytest.fixture(scope="module")
def run(scene):
    return full_order(CASE, scene)


def with_last(array, value):
    changed = array.copy()
    changed[-1] = value
    return changed


def broken(run, check):
    """The run with one change that violates ``check``."""
    drift = run.velocities.copy()
    drift[10:, :, 0] += 1e-6 * np.abs(run.velocities).max()
    squeezed = run.positions[-1] * [1.0, 0.9, 1.0]
    changes = {
        "finite": {"positions": run.positions[:-1], "blowup_frame": 59},
        "bounded": {"positions": with_last(run.positions, 3.0 * run.positions[-1])},
        "objective": {"excess": with_last(run.excess, 1e-12)},
        "energy": {"energy": with_last(run.energy, 1.001 * run.energy[0])},
        "momentum": {"velocities": drift},
        "determinism": {"positions": np.nextafter(run.positions, np.inf)},
        "recovers": {"positions": with_last(run.positions, squeezed)},
        "still": {},
    }
    return replace(run, **changes[check])


@pytest.mark.parametrize("check", CHECKS)
def test_a_check_finds_its_fault(check, scene, run):
    if check != "still":
        assert CHECKS[check](CASE, scene, run) == ""
    assert CHECKS[check](CASE, scene, broken(run, check)) != ""


def test_a_case_that_is_not_refused_is_a_fault():
    assert faults(replace(CASE, holds=("refused",))) == ["was not refused"]


@pytest.mark.parametrize(("error", "rises"), [(0.0, False), (1e-8, True)])
def test_the_allowance_tells_a_wrong_projection_from_rounding(scene, error, rises):
    """At rest the objective is zero; a relative error of 1e-8 of the right-hand side raises it."""
    group = scene.groups[0]

    def accumulate(y, rhs):
        part = np.zeros_like(rhs)
        energy = group.accumulate(y, part)
        rhs += (1.0 + error) * part
        return energy

    wrong = SimpleNamespace(name="wrong", begin_frame=group.begin_frame, accumulate=accumulate)
    found = record(scene, scene.stepper(local_steps=[wrong]), scene.initial_state())
    assert (found.excess.max() > 0.0) == rises
