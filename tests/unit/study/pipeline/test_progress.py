"""One line a job, with counts and the time that is left."""

import logging
from collections.abc import Iterable

import pytest
from snakemake.logging import LoggerManager
from snakemake.settings.types import OutputSettings
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry

from study.pipeline.progress import Estimate, Expected, rounded


def jobs(count: int, seconds: float = 10.0, share: float = 0.5) -> dict[int, Expected]:
    """Equal jobs that wait for none."""
    return {number: Expected(seconds, share, 0.0) for number in range(count)}


def estimate(expected: dict[int, Expected], ran: Iterable[tuple[int, float, float]]) -> Estimate:
    """After some jobs that ran, each with its start and end."""
    made = Estimate(expected)
    for job, start, end in ran:
        made.begun[job], made.ended[job] = start, end
    return made


def test_nothing_is_said_before_jobs_have_ended():
    assert Estimate({}).left(0.0) is None
    assert estimate(jobs(4), []).left(5.0) is None
    assert estimate(jobs(4), [(0, 0.0, 10.0)]).left(10.0) is None


def test_a_job_that_compiles_does_not_count_for_the_others():
    ran = [(0, 0.0, 200.0), (1, 0.0, 10.0), (2, 10.0, 20.0), (3, 20.0, 30.0), (4, 190.0, 200.0)]
    made = estimate(jobs(9, share=1.0), ran)
    assert made.left(200.0) <= 4 * 10.0


def test_what_waits_for_each_other_takes_as_long_as_the_chain():
    expected = jobs(2) | {2: Expected(10.0, 0.5, 20.0), 3: Expected(10.0, 0.5, 10.0)}
    made = estimate(expected | {4: Expected(10.0, 0.5, 0.0)}, [(0, 0.0, 10.0), (1, 0.0, 10.0)])
    assert made.left(10.0) == pytest.approx(30.0)


@pytest.mark.parametrize("slower", [0.5, 1.0, 9.0])
def test_what_is_left_is_scaled_by_how_long_finished_jobs_took(slower):
    """Two at a time, of 20 equal jobs."""
    took = slower * 10.0
    ran = [(number, took * (number // 2), took * (number // 2 + 1)) for number in range(8)]
    assert estimate(jobs(20, share=1.0), ran).left(4 * took) == pytest.approx(6 * took)


def test_what_runs_is_counted_by_its_rest():
    made = estimate(jobs(3, share=1.0), [(0, 0.0, 10.0), (1, 10.0, 20.0)])
    made.begun[2] = 20.0
    assert made.left(24.0) == pytest.approx(6.0)
    assert 0.0 < made.left(60.0) < 6.0


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
    snakemake.info("Jobs take 11 s", extra={"expected": jobs(11, 1.0)})
    job = {"event": LogEvent.JOB_INFO, "rule_name": "fom", "reason": "Missing output files"}
    snakemake.info("", extra={**job, "jobid": 3, "rule_msg": "Full-order run of sheet"})
    snakemake.info("", extra={"event": LogEvent.JOB_FINISHED, "job_id": 3})
    snakemake.info("", extra={**job, "jobid": 5, "rule_msg": None})
    snakemake.info("", extra={"event": LogEvent.JOB_FINISHED, "job_id": 5})
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
    assert [line[:7] for line in lines[:4]] == ["[ 1/11]", "[ 2/11]", "[ 3/11]", "[ 3/11]"]
    assert lines[0].endswith(" Full-order run of sheet")
    assert lines[1].endswith(" fom")
    assert lines[2].endswith(" fom   less than a minute left")
    assert lines[3].endswith(" FAILED: Full-order run of sheet")
    assert lines[4:] == [
        "Missing input files for rule fom",
        "a warning",
        "Nothing to be done (all requested files are present and up to date).",
    ]
