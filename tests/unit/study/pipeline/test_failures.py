"""The last lines of a failed run: every cause in words of its own."""

import errno
import logging
import os

import pytest
from snakemake_interface_logger_plugins.common import LogEvent

from study.artifact.logs import job_log
from study.pipeline.failures import ADVICE, Failures, cause, plain
from study.pipeline.signals import ENDINGS, KEPT

FOM = "pdrom: job fom failed while making results/x.h5"
ENDED = "CalledProcessError in file x, line 3:\nCommand 'python x.py' "


@pytest.fixture
def snakemake():
    """Stands for Snakemake's logger, with somebody who listens for failures."""
    logger = logging.Logger("snakemake")
    logger.failures = Failures()
    logger.addHandler(logger.failures)
    return logger


def fail(logger, rule, log, said, indent=False):
    logger.error(f"RuleException:\n{said}", extra={"event": LogEvent.ERROR})
    job = {"rule_name": rule, "rule_msg": None, "indent": indent}
    job |= {"log": [str(log)], "output": ["results/x.h5"]}
    logger.error("Error in rule", extra={"event": LogEvent.JOB_ERROR, **job})


def end(logger):
    text, status = logger.failures.end()
    lines = text.splitlines()
    assert lines[-1] == ADVICE
    return status, lines[:-1]


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (ENDED + "died with <Signals.SIGKILL: 9>.", "killed (SIGKILL): out of memory?"),
        (ENDED + "returned non-zero exit status 137.", "killed (SIGKILL): out of memory?"),
        (ENDED + "returned non-zero exit status 130.", "interrupted"),
        (ENDED + "returned non-zero exit status 143.", "ended by SIGTERM"),
        (ENDED + "died with <Signals.SIGSEGV: 11>.", "crashed (SIGSEGV), see a.log"),
        (ENDED + "returned non-zero exit status 139.", "crashed (SIGSEGV), see a.log"),
        (ENDED + "returned non-zero exit status 3.", "exit status 3, see a.log"),
        (ENDED + "exit status 69.", "the process that jobs start from is gone: out of memory?"),
        ("OSError: [Errno 28] No space left on device: 'x'", "no space left on the disk"),
        ("SLURM-job '3' failed, SLURM status is: 'CANCELLED'. x", "SLURM says cancelled"),
        ("SLURM-job '3' failed, SLURM status is: 'OUT_OF_MEMORY'.", "SLURM says out of memory"),
        ("", "it ended without an error message, see a.log"),
    ],
)
def test_causes_are_told_apart(said, expected):
    assert cause(said, "a.log") == expected


@pytest.mark.parametrize(
    ("written", "why"),
    [
        ("slurmstepd: error: *** JOB 3 ON vm CANCELLED AT 2026-01-01T00:00:00 ***", "cancelled"),
        (
            "error: *** JOB 3 ON n7 CANCELLED AT 2026-01-01T00:00:00 DUE TO TIME LIMIT ***",
            "time limit",
        ),
        ("Exited with exit code 1", "a job of it failed"),
    ],
)
def test_a_batch_on_a_cluster_is_named_with_the_jobs_that_wrote_an_error(
    snakemake, tmp_path, written, why
):
    whole, failed, unstarted = (tmp_path / name for name in ("3.log", "fom.log", "pod.log"))
    whole.write_text(f"Building DAG\n{written}\n")
    failed.write_text("2026-01-01 00:00:00,000 ERROR   pdrom: too stiff\n")
    group = {"event": LogEvent.GROUP_ERROR, "groupid": "scene_x", "aux_logs": [str(whole)]}
    snakemake.error("Error in group scene_x", extra=group)
    for rule, log in (("fom", failed), ("pod", unstarted)):
        fail(snakemake, rule, log, "", indent=True)
    assert end(snakemake) == (
        1,
        [f"pdrom: batch scene_x failed: {why} (log: {whole})", "pdrom: job fom failed: too stiff"],
    )


def test_every_failed_job_is_named_with_its_error(snakemake, tmp_path):
    log = tmp_path / "job.log"
    with pytest.raises(SystemExit), job_log(str(log)):
        raise ValueError("vertex 3 is nan")
    fail(snakemake, "pod", log, ENDED + "returned non-zero exit status 1.")
    fail(snakemake, "fom", tmp_path / "none.log", ENDED + "died with <Signals.SIGKILL: 9>.")
    # a job that could not start did not open its log: the error is of an earlier run
    os.utime(log, (1, 1))
    fail(snakemake, "fom", log, ENDED + "returned non-zero exit status 127.")
    error = f"pdrom: job pod failed: ValueError: vertex 3 is nan (traceback in {log})"
    causes = ("killed (SIGKILL): out of memory?", f"exit status 127, see {log}")
    assert end(snakemake) == (1, [error, *(f"{FOM}: {cause}" for cause in causes)])


@pytest.mark.parametrize("number", ENDINGS)
def test_a_run_that_a_signal_ended_says_so_and_no_more(number, snakemake):
    """Not even of a job that failed otherwise, whose next run fails again."""
    fail(snakemake, "fom", "none.log", ENDED + "returned non-zero exit status 1.")
    snakemake.failures.note(number)
    fail(snakemake, "pod", "none.log", ENDED + "returned non-zero exit status 130.")
    assert snakemake.failures.end() == (f"pdrom: {ENDINGS[number]}; {KEPT}\n", 128 + number)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ValueError("two\nlines"), "pdrom: ValueError: two lines"),
        (KeyError("scene"), "pdrom: KeyError: 'scene'"),
        (OSError(errno.ENOSPC, "", "a"), "pdrom: a: No space left on device; make room"),
        (NotADirectoryError(errno.ENOTDIR, "", "a/b"), "pdrom: a/b: Not a directory; remove what"),
    ],
)
def test_an_error_outside_of_jobs_is_one_line(error, words, snakemake, caplog):
    snakemake.addFilter(plain)
    snakemake.addHandler(caplog.handler)
    try:
        raise error
    except type(error) as caught:
        text = "Traceback\n" + str(caught)
        snakemake.error(text, extra={"event": LogEvent.ERROR, "exception": "x"})
    (line,) = caplog.messages
    assert line.startswith(words)
    assert "\n" not in line
