"""One line a job, with counts, share of the work and the time that is left."""

import logging

import pytest
from snakemake.logging import LoggerManager
from snakemake.settings.types import OutputSettings
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry

from study.pipeline.progress import Estimate, rounded


def test_nothing_is_said_before_a_twentieth_of_the_work_is_done():
    estimate = Estimate({0: 4.0, 1: 6.0, 2: 90.0}, 0.0)
    estimate.finish(0)
    assert estimate.words(5.0) == Estimate({}, 0.0).words(5.0) == ""
    estimate.finish(1)
    assert estimate.words(60.0) == "   10% done, about 9 min left"


@pytest.mark.parametrize("slower", [1.0, 9.0])
def test_what_is_left_is_scaled_by_how_long_finished_jobs_took(slower):
    """Equal jobs one after the other, and one without a measured time, which does not count."""
    estimate = Estimate(dict.fromkeys(range(20), 60.0), 100.0)
    for number in (*range(10), 99):
        estimate.finish(number)
    words = f"   50% done, {rounded(600.0 * slower)} left"
    assert estimate.words(100.0 + 600.0 * slower) == words


def test_words():
    words = ["less than a minute", "about 1.5 min", "about 2 min", "about 9 min", "about 2.0 h"]
    assert [rounded(seconds) for seconds in (5, 80, 130, 540, 7200)] == words


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
    snakemake.info("Jobs take 11 s", extra={"expected": dict.fromkeys(range(11), 1.0)})
    job = {"event": LogEvent.JOB_INFO, "rule_name": "fom", "reason": "Missing output files"}
    snakemake.info("", extra={**job, "jobid": 3, "rule_msg": "Full-order run of sheet"})
    snakemake.info("", extra={"event": LogEvent.JOB_FINISHED, "job_id": 3})
    snakemake.info("", extra={**job, "jobid": 5, "rule_msg": None})
    snakemake.info("", extra={"event": LogEvent.JOB_FINISHED, "job_id": 5})
    snakemake.info("", extra={**job, "jobid": 4, "rule_msg": None})
    error = {"event": LogEvent.JOB_ERROR, "rule_name": "fom", "rule_msg": "Full-order run of sheet"}
    snakemake.error("Error in rule", extra=error)
    for fault, text in (
        ("RuleException", "CalledProcessError"),
        ("MissingInputException", "Missing input files for rule fom"),
    ):
        snakemake.error(text, extra={"event": LogEvent.ERROR, "exception": fault})
    snakemake.warning("a warning")
    snakemake.info("Nothing to be done (all requested files are present and up to date).")
    lines = snakemake.err()
    assert [line[:7] for line in lines[:4]] == ["[ 1/11]", "[ 2/11]", "[ 3/11]", "[ 3/11]"]
    assert lines[0].endswith(" Full-order run of sheet")
    assert lines[1].endswith(" fom   9% done, less than a minute left")
    assert lines[2].endswith(" fom   18% done, less than a minute left")
    assert lines[3].endswith(" FAILED: Full-order run of sheet")
    assert lines[4:] == [
        "Missing input files for rule fom",
        "a warning",
        "Nothing to be done (all requested files are present and up to date).",
    ]
