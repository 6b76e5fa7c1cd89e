"""What a dry run says last: jobs by rule with reasons in few words, and their minutes."""

import logging

import pytest
from snakemake_interface_logger_plugins.common import LogEvent

from pdrom.core.yamlfile import read_yaml
from pdrom.pipeline.costs import CostModel
from pdrom.pipeline.plan import Plan
from pdrom.pipeline.preview import Preview, shortened
from pdrom.pipeline.study import Study
from places import ROOT


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        ("Missing output files: a.h5; Input files updated by another job: b.h5",
         {"output is missing"}),
        ("Input files updated by another job: a.h5, b.h5", {"input is made anew"}),
        ("Updated input files: a.yaml; Code has changed since last execution; Params have changed "
         "since last execution: {}",
         {"input is newer", "script has changed", "settings or code have changed"}),
        ("Rules with neither input nor output files are always executed.", set()),
    ],
)  # fmt: skip
def test_reasons_are_told_without_the_files(reason, words):
    assert shortened(reason) == words


def job(rule, reason, output=("a",), threads=1, **labels):
    return logging.makeLogRecord(
        {
            "event": LogEvent.JOB_INFO, "rule_name": rule, "reason": reason, "threads": threads,
            "output": list(output), "wildcards": labels,
        }
    )  # fmt: skip


END = logging.makeLogRecord({"msg": "This was a dry-run (flag -n). The order of jobs ..."})


def test_jobs_are_counted_by_rule_and_their_times_added():
    seconds = {"fom": 600.0, "timing": 1200.0}
    preview = Preview(lambda rule, labels: seconds[rule] * float(labels["scale"]), cores=2)
    preview.emit(job("fom", "Missing output files: a", scale=1.0))
    preview.emit(job("fom", "Params have changed since last execution: {}", scale=3.0))
    preview.emit(job("timing", "Missing output files: a", threads=8, scale=1.0))
    preview.emit(job("all", "Input files updated by another job: a", output=()))
    assert preview.text() == ""
    preview.emit(END)
    assert preview.text().splitlines() == [
        "    2 fom     output is missing, settings or code have changed",
        "    1 timing  output is missing",
        "    1 all     input is made anew",
        "pdrom: 4 jobs, about 40 min on 2 cores, about 60 min of processor time",
    ]


def test_what_has_nothing_to_do_says_no_more():
    preview = Preview(lambda rule, labels: 1.0, cores=1)
    preview.emit(logging.makeLogRecord({"msg": "Nothing to be done"}))
    assert preview.text() == ""


def test_a_job_takes_what_jobs_of_its_kind_were_measured_to_take(monkeypatch):
    monkeypatch.chdir(ROOT)
    tiny = read_yaml(ROOT / "config" / "default.yaml") | read_yaml(ROOT / "config" / "tiny.yaml")
    plan, costs = Plan(Study.load(tiny | {"scenes": ["spring_oop"]})), CostModel.load(ROOT)
    run = {"scene": "spring_oop", "run": "train"}
    assert plan.seconds("fom", run) == costs.cost("fom", plan.study.size("spring_oop")).seconds
    assert plan.seconds("budget_table", {}) == costs.cost("table").seconds
    assert plan.seconds("figure_budget", {}) == costs.cost("figure").seconds
    assert plan.seconds("paper_inputs", {}) == costs.cost("paper").seconds
