"""The last lines of a run that ended well."""

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from pdrom.core.store import write_table
from pdrom.core.yamlfile import read_yaml
from pdrom.pipeline.commandline import CommandLine
from pdrom.pipeline.folders import Folders
from pdrom.pipeline.full import apart
from pdrom.pipeline.study import Study
from pdrom.pipeline.summary import minutes, processor_seconds, summary
from places import ROOT

FIGURES = ("results/figures/a.pdf", "results/figures/b.pdf")
TABLES = ("results/tables/claims.csv",)


@pytest.fixture(autouse=True)
def project(tmp_path, monkeypatch):
    """A folder with some results."""
    monkeypatch.chdir(tmp_path)
    Path("results/figures").mkdir(parents=True)
    Path(FIGURES[0]).touch()
    claims = pd.DataFrame(
        {"claim": ["C1", "C2"], "verdict": ["holds", "fails"], "verdict_beyond": ["depends", "x"]}
    )
    write_table(claims, TABLES[0])


def lines(*arguments: str, words: str = "") -> dict[str, str]:
    text = summary(CommandLine.parse(arguments), Folders(), FIGURES, TABLES, words)
    assert text.endswith("\n")
    said = [line.removeprefix("pdrom: ") for line in text.splitlines()]
    return dict(line.split(": ", 1) for line in said)


def test_a_whole_study():
    said = lines("--config", "ranks=[3]")
    assert said["configuration"] == "config/default.yaml, ranks=[3]"
    assert said["verdicts (as published / beyond)"] == "C1 holds / depends, C2 fails / x"
    assert said["manuscript"] == "paper/main.pdf"
    assert said["figures"] == "1 in results/figures"
    assert said["tables"] == "1 in results/tables"
    assert said["report"] == "./reproduce --report report.html"
    assert "of processor time" in said["time"]


def test_verdicts_of_another_study_are_told_from_those_of_the_full_one():
    words = "of coarse meshes, not those of the study"
    said = lines("--configfile", "my.yaml", words=words)
    assert said[f"verdicts (as published / beyond; {words})"].startswith("C1 holds")


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({}, ""),
        ({"coarsen": {"resolution": 0.4}}, "of coarse meshes, not"),
        ({"coarsen": {"resolution": 0.4, "frames": 0.5}}, "of coarse meshes and short runs, not"),
        ({"ranks": [3]}, "of this configuration, not those of the study"),
    ],
)
def test_a_study_says_how_it_differs_from_the_full_one(config, words):
    found = apart(Study.load({**read_yaml(ROOT / "config" / "default.yaml"), **config}, ROOT))
    assert found.startswith(words)
    assert bool(found) == bool(words)


def test_single_files():
    said = lines("--configfile", "my.yaml", "--", "results/x", "results/y")
    assert list(said) == ["configuration", "made", "time"]
    assert said["configuration"] == "my.yaml"
    assert said["made"] == "results/x, results/y"


def test_without_verdicts_the_rest_is_said():
    Path(TABLES[0]).unlink()
    assert not [word for word in lines() if word.startswith("verdicts")]


def test_processor_time_counts_what_this_process_waited_for():
    work = "import time\nwhile time.process_time() < 0.3: pass"
    before = processor_seconds()
    subprocess.run([sys.executable, "-c", work], check=True)
    assert processor_seconds() - before >= 0.2


def test_minutes():
    assert (minutes(59.4), minutes(60), minutes(125)) == ("59 s", "1 min 0 s", "2 min 5 s")
