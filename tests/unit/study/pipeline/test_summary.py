"""The last lines of a finished run."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from pdrom.core.store import write_table
from study.pipeline.commandline import CommandLine
from study.pipeline.folders import Folders
from study.pipeline.summary import processor_seconds, summary

FIGURES = ("results/figures/a.pdf", "results/figures/b.pdf")
TABLES = ("results/tables/claims.csv",)


@pytest.fixture(autouse=True)
def project(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("results/figures").mkdir(parents=True)
    Path(FIGURES[0]).touch()
    claims = pd.DataFrame(
        {"claim": ["C1", "C2"], "verdict": ["holds", "fails"], "verdict_beyond": ["depends", "x"]}
    )
    write_table(claims, TABLES[0])


def test_a_finished_study_prints_its_configuration_verdicts_and_results():
    listed = {"figures": FIGURES, "tables": TABLES}
    fixed = {k: [SimpleNamespace(outputs={"": path}) for path in v] for k, v in listed.items()}
    plan = SimpleNamespace(folders=Folders(), fixed=fixed, tables=["claims"], absent="")
    text = summary(CommandLine(["--config", "ranks=[3]"]), plan)
    said = dict(line.removeprefix("pdrom: ").split(": ", 1) for line in text.splitlines())
    for key, part in {
        "configuration": "config/default.yaml, ranks=[3]",
        "verdicts (as published / improved)": "C1 holds / depends, C2 fails / x",
        "manuscript": "paper/main.pdf, paper/supplement.pdf",
        "web pages": "results/article/index.html",
        "figures": "2 in results/figures",
        "tables": "1 in results/tables",
        "time": "of processor time",
    }.items():
        assert part in said[key]


def test_processor_time_includes_finished_child_processes():
    work = "import time\nwhile time.process_time() < 0.3: pass"
    before = processor_seconds()
    subprocess.run([sys.executable, "-c", work], check=True)
    assert processor_seconds() - before >= 0.2
