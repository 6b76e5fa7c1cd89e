"""The last lines of a failed run name each failed job, its file and the cause."""

import logging
import signal

import pytest
from snakemake_interface_logger_plugins.common import LogEvent

from study.artifact.logs import job_log
from study.pipeline.failures import Failures
from study.pipeline.signals import ENDINGS

ENDED = "CalledProcessError in file x, line 3:\nCommand 'python x.py' "


def fail(failures, rule, log, said, indent=False):
    """Report a failed job as Snakemake does."""
    error = {"event": LogEvent.ERROR, "msg": f"RuleException:\n{said}"}
    job = {"event": LogEvent.JOB_ERROR, "rule_name": rule, "rule_msg": None, "indent": indent}
    for record in (error, job | {"log": [str(log)], "output": ["results/x.h5"]}):
        failures.emit(logging.makeLogRecord(record))


def test_each_failed_job_is_named_with_its_error_or_cause(tmp_path):
    failures, log = Failures(), tmp_path / "job.log"
    with pytest.raises(SystemExit), job_log(str(log)):
        raise ValueError("vertex 3 is nan")
    fail(failures, "pod", log, ENDED + "returned non-zero exit status 1.")
    fail(failures, "fom", tmp_path / "none.log", ENDED + "died with <Signals.SIGKILL: 9>.")
    text, status = failures.end()
    first, second, _ = text.splitlines()
    assert status == 1
    assert first == f"pdrom: job pod failed: ValueError: vertex 3 is nan (traceback in {log})"
    assert "job fom failed while making results/x.h5" in second
    assert str(tmp_path / "none.log") in second


def test_a_failed_batch_is_named_with_the_last_line_of_its_log(tmp_path):
    """Of its jobs, only those are named that wrote an error."""
    failures = Failures()
    whole, failed = (tmp_path / name for name in ("3.log", "fom.log"))
    whole.write_text("Building DAG\nerror: *** JOB 3 ON n7 CANCELLED DUE TO TIME LIMIT ***\n")
    failed.write_text("2026-01-01 00:00:00,000 ERROR   pdrom: too stiff\n")
    group = {"event": LogEvent.GROUP_ERROR, "groupid": "scene_x", "aux_logs": [str(whole)]}
    failures.emit(logging.makeLogRecord(group))
    for rule, log in (("fom", failed), ("pod", tmp_path / "none.log")):
        fail(failures, rule, log, "", indent=True)
    batch, job, _ = failures.end()[0].splitlines()
    assert [part for part in ("scene_x", "TIME LIMIT", str(whole)) if part not in batch] == []
    assert job == "pdrom: job fom failed: too stiff"


@pytest.mark.parametrize("number", ENDINGS)
def test_a_run_that_a_signal_ended_names_no_failed_job(number):
    failures = Failures()
    fail(failures, "fom", "none.log", ENDED + "returned non-zero exit status 1.")
    before = [signal.getsignal(each) for each in ENDINGS]
    with pytest.raises(KeyboardInterrupt):
        failures.interrupt(number)
    for each, handler in zip(ENDINGS, before, strict=True):
        signal.signal(each, handler)
    text, status = failures.end()
    assert status == 128 + number
    assert text.startswith(f"pdrom: {ENDINGS[number]}; ")
    assert text.count("\n") == 1
