"""One line a job, with counts and the time that is left."""

import logging

import pytest
from snakemake.logging import LoggerManager
from snakemake.settings.types import OutputSettings
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry

from pdrom.pipeline.progress import Estimate, rounded


def test_the_time_left_follows_from_the_times_of_each_rule():
    estimate = Estimate()
    estimate.planned.update(fom=4, table=2)
    assert estimate.left(0.0) is None
    for job in range(2):
        estimate.start(job, "fom", 10.0 * job)
        estimate.finish(job, 10.0 * job + 10.0)
    assert estimate.left(20.0) == pytest.approx(2 * 10.0 + 2 * 10.0)
    estimate.start(2, "table", 20.0)
    estimate.finish(2, 22.0)
    assert estimate.left(22.0) == pytest.approx(2 * 10.0 + 1 * 2.0)


def test_jobs_at_the_same_time_shorten_it():
    estimate = Estimate()
    estimate.planned.update(fom=4)
    for job in range(2):
        estimate.start(job, "fom", 0.0)
        estimate.finish(job, 10.0)
    assert estimate.left(10.0) == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(5, "less than a minute"), (540, "about 9 min"), (7200, "about 2.0 h")],
)
def test_words(seconds, words):
    assert rounded(seconds) == words


@pytest.fixture
def snakemake(capsys):
    """Snakemake's logging with the plugin, as ``--logger pdrom`` sets it up."""
    logger = logging.Logger("snakemake")
    plugin = LoggerPluginRegistry().get_plugin("pdrom")
    handler = plugin.log_handler(OutputSettings(), None)
    manager = LoggerManager.__new__(LoggerManager)
    manager.settings = OutputSettings()
    handler.addFilter(manager._default_filter())
    logger.addHandler(handler)
    logger.err = lambda: capsys.readouterr().err.splitlines()
    return logger


def test_of_a_dry_run_no_job_has_a_line(capsys):
    plugin = LoggerPluginRegistry().get_plugin("pdrom")
    handler = plugin.log_handler(OutputSettings(dryrun=True), None)
    job = {"event": LogEvent.JOB_INFO, "rule_name": "fom", "jobid": 3, "rule_msg": "Run"}
    handler.handle(logging.makeLogRecord({"created": 0.0, **job}))
    assert capsys.readouterr().err == ""


def test_the_lines_of_a_run(snakemake):
    snakemake.info("Building DAG of jobs...")
    stats = {"fom": 10, "table": 1, "total": 11}
    snakemake.info("stats", extra={"event": LogEvent.RUN_INFO, "stats": stats})
    job = {"event": LogEvent.JOB_INFO, "rule_name": "fom", "reason": "Missing output files"}
    snakemake.info("", extra={**job, "jobid": 3, "rule_msg": "Full-order run of sheet"})
    snakemake.info("", extra={"event": LogEvent.JOB_FINISHED, "job_id": 3})
    snakemake.info("", extra={**job, "jobid": 4, "rule_msg": None})
    error = {"event": LogEvent.JOB_ERROR, "rule_name": "fom", "jobid": 3}
    snakemake.error("Error in rule", extra=error)
    for fault, text in (
        ("RuleException", "CalledProcessError"),
        ("WorkflowError", "At least one job did not complete successfully."),
        ("MissingInputException", "Missing input files for rule fom"),
    ):
        snakemake.error(text, extra={"event": LogEvent.ERROR, "exception": fault})
    snakemake.warning("a warning")
    snakemake.info("Nothing to be done (all requested files are present and up to date).")
    lines = snakemake.err()
    assert [line[:7] for line in lines[:3]] == ["[ 1/11]", "[ 2/11]", "[ 2/11]"]
    assert lines[0].endswith(" Full-order run of sheet")
    assert lines[1].endswith(" fom   less than a minute left")
    assert lines[2].endswith(" FAILED: Full-order run of sheet")
    assert lines[3:] == [
        "Missing input files for rule fom",
        "a warning",
        "Nothing to be done (all requested files are present and up to date).",
    ]
