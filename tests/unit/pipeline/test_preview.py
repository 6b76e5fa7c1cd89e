"""What a dry run says last: jobs by rule with reasons in few words, and their minutes."""

import logging

import pytest
from snakemake_interface_logger_plugins.common import LogEvent

from pdrom.pipeline.preview import Preview, shortened


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


def job(rule, reason, *logs, threads=1):
    return logging.makeLogRecord(
        {
            "event": LogEvent.JOB_INFO, "rule_name": rule, "reason": reason, "threads": threads,
            "log": logs,
        }
    )  # fmt: skip


END = logging.makeLogRecord({"msg": "This was a dry-run (flag -n). The order of jobs ..."})


def test_jobs_are_counted_by_rule_and_their_times_added():
    seconds = {"fom/a.log": 600.0, "fom/b.log": 1800.0, "timing.log": 1200.0}
    preview = Preview(seconds.__getitem__, cores=2)
    preview.emit(job("fom", "Missing output files: a", "fom/a.log"))
    preview.emit(job("fom", "Params have changed since last execution: {}", "fom/b.log"))
    preview.emit(job("timing", "Missing output files: a", "timing.log", threads=8))
    preview.emit(job("all", "Input files updated by another job: a"))
    assert preview.text() == ""
    preview.emit(END)
    assert preview.text().splitlines() == [
        "    2 fom     output is missing, settings or code have changed",
        "    1 timing  output is missing",
        "    1 all     input is made anew",
        "pdrom: 4 jobs, about 40 min on 2 cores, about 60 min of processor time",
    ]


def test_what_has_nothing_to_do_says_no_more():
    preview = Preview(lambda log: 1.0, cores=1)
    preview.emit(logging.makeLogRecord({"msg": "Nothing to be done"}))
    assert preview.text() == ""
