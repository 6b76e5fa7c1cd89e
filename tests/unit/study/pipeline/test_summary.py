"""The last lines of a dry run and of a finished one."""

import logging
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
from snakemake_interface_logger_plugins.common import LogEvent
from study.pipeline.progress import Preview

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


def lines(*arguments: str, words: str = "") -> dict[str, str]:
    listed = {"figures": FIGURES, "tables": TABLES}
    fixed = {k: [SimpleNamespace(outputs={"": path}) for path in v] for k, v in listed.items()}
    study = SimpleNamespace(apart=words)
    plan = SimpleNamespace(
        folders=Folders(), study=study, fixed=fixed, tables=["claims"], absent=""
    )  # fmt: skip
    text = summary(CommandLine(arguments), plan)
    return dict(line.removeprefix("pdrom: ").split(": ", 1) for line in text.splitlines())


def test_a_whole_study_names_its_configuration_verdicts_and_results():
    assert "times" not in lines()
    times = {"control_low": [1.0], "control_high": [1.0], "processor_share": [0.5]}
    write_table(pd.DataFrame(times), "results/tables/frame_times.csv")
    said = lines("--config", "ranks=[3]", words="of coarse meshes")
    for key, part in {
        "configuration": "config/default.yaml, ranks=[3]",
        "verdicts (as published / beyond; of coarse meshes)": "C1 holds / depends, C2 fails / x",
        "manuscript": "paper/main.pdf, paper/supplement.pdf",
        "as pages": "results/article/index.html",
        "figures": "2 in results/figures",
        "tables": "1 in results/tables",
        "report": "./reproduce --report report.html",
        "time": "of processor time",
        "times": "unreliable",  # the processor is shared
    }.items():
        assert part in said[key]
    Path(TABLES[0]).unlink()  # without verdicts the rest is said
    assert not [word for word in lines() if word.startswith("verdicts")]


def test_processor_time_counts_what_this_process_waited_for():
    work = "import time\nwhile time.process_time() < 0.3: pass"
    before = processor_seconds()
    subprocess.run([sys.executable, "-c", work], check=True)
    assert processor_seconds() - before >= 0.2


def job(rule, reason, *logs, threads=1):
    return logging.makeLogRecord(
        {
            "event": LogEvent.JOB_INFO, "rule_name": rule, "reason": reason, "threads": threads,
            "log": logs, "output": [f"{rule}.csv".replace("timing", "b")],
        }
    )  # fmt: skip


def test_jobs_are_counted_by_rule_and_their_times_added():
    seconds = {"fom/a.log": 600.0, "fom/b.log": 1800.0, "timing.log": 1200.0}
    preview = Preview(seconds.__getitem__, 2, {"b.csv": "output is damaged"})
    preview.emit(logging.makeLogRecord({"msg": "Nothing to be done"}))
    assert preview.text() == ""
    preview.emit(job("fom", "Missing output files: a", "fom/a.log"))
    preview.emit(job("fom", "Params have changed since last execution: {}", "fom/b.log"))
    preview.emit(job("timing", "Forced execution", "timing.log", threads=8))
    preview.emit(job("all", "Input files updated by another job: a"))
    assert preview.text().splitlines() == [
        "    2 fom     output is missing, settings or code have changed",
        "    1 timing  output is damaged",
        "    1 all     input is made again",
        "pdrom: 4 jobs, about 40 min on 2 cores, about 60 min of processor time",
    ]
