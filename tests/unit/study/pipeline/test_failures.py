"""The last lines of a failed run name each failed job, its file and the cause."""

import logging

import pytest
from snakemake_interface_logger_plugins.common import LogEvent

from study.artifact.logs import job_log
from study.pipeline.failures import Failures


def fail(failures, rule, log, said="", indent=False):
    """Report a failed job as Snakemake does."""
    error = {"event": LogEvent.ERROR, "msg": f"RuleException:\n{said}"}
    job = {"event": LogEvent.JOB_ERROR, "rule_name": rule, "rule_msg": None, "indent": indent}
    for record in (error, job | {"log": [str(log)], "output": ["results/x.h5"]}):
        failures.emit(logging.makeLogRecord(record))


def test_each_failed_job_is_named_with_its_error_or_the_message_of_snakemake(tmp_path):
    failures, log = Failures(), tmp_path / "job.log"
    with pytest.raises(SystemExit), job_log(str(log)):
        raise ValueError("vertex 3 is nan")
    fail(failures, "pod", log, "CalledProcessError")
    fail(failures, "fom", tmp_path / "none.log", "Command 'x.py' died with <Signals.SIGKILL: 9>.")
    first, second, _ = failures.text().splitlines()
    assert first == f"pdrom: job pod failed: ValueError: vertex 3 is nan (traceback in {log})"
    for part in ("job fom ", "results/x.h5", "SIGKILL", str(tmp_path / "none.log")):
        assert part in second


def test_a_failed_batch_is_named_with_the_last_line_of_its_log(tmp_path):
    """Only the jobs of the batch that wrote an error are named."""
    failures = Failures()
    whole, failed = (tmp_path / name for name in ("3.log", "fom.log"))
    whole.write_text("Building DAG\nerror: *** JOB 3 ON n7 CANCELLED DUE TO TIME LIMIT ***\n")
    failed.write_text("2026-01-01 00:00:00,000 ERROR   pdrom: too stiff\n")
    group = {"event": LogEvent.GROUP_ERROR, "groupid": "scene_x", "aux_logs": [str(whole)]}
    failures.emit(logging.makeLogRecord(group))
    for rule, log in (("fom", failed), ("pod", tmp_path / "none.log")):
        fail(failures, rule, log, indent=True)
    batch, job, _ = failures.text().splitlines()
    assert [part for part in ("scene_x", "TIME LIMIT", str(whole)) if part not in batch] == []
    assert job == "pdrom: job fom failed: too stiff"
