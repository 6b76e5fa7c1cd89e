"""A run prints one line for each job: counts, share of the work and remaining time."""

import logging

import pytest
from snakemake.settings.types import OutputSettings
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry

from snakemake_logger_plugin_pdrom import rounded


@pytest.fixture
def emit(capsys):
    """Send records to the plugin, as ``--logger pdrom`` sets it up; return the lines it prints."""
    plugin = LoggerPluginRegistry().get_plugin("pdrom")

    def send(*records, dryrun=False):
        handler = plugin.log_handler(OutputSettings(dryrun=dryrun), None)
        for record in records:
            handler.handle(
                logging.makeLogRecord({"created": 0.0, "levelno": logging.INFO, **record})
            )
        return capsys.readouterr().err.splitlines()

    return send


JOB = {"event": LogEvent.JOB_INFO, "rule_name": "fom", "rule_msg": None, "created": 30.0}
DONE = {"event": LogEvent.JOB_FINISHED}


def test_jobs_have_counts_and_after_5_percent_of_the_work_the_time_left(emit):
    """A job without a measured time does not count."""
    lines = emit(
        {"event": LogEvent.RUN_INFO, "stats": {"total": 11}},
        {"expected": {0: 4.0, 1: 6.0, 2: 90.0}},
        JOB | {"rule_msg": "Run of sheet"},
        DONE | {"job_id": 0},
        JOB,
        DONE | {"job_id": 99},
        DONE | {"job_id": 1},
        JOB | {"created": 60.0},
    )
    assert [line[:7] for line in lines] == ["[ 1/11]", "[ 2/11]", "[ 3/11]"]
    assert [line[14:] for line in lines[:2]] == ["Run of sheet", "fom"]
    assert lines[2].endswith(f" fom   10% done, {rounded(540.0)} left")


def test_failed_jobs_warnings_and_errors_outside_jobs_are_printed(emit):
    failed = {"event": LogEvent.JOB_ERROR, "rule_name": "fom", "rule_msg": None}
    error = {"event": LogEvent.ERROR, "levelno": logging.ERROR}
    lines = emit(
        {"msg": "Building DAG of jobs..."},
        failed,
        error | {"exception": "RuleException", "msg": "CalledProcessError"},
        error | {"exception": "MissingInputException", "msg": "Missing input files"},
        {"levelno": logging.WARNING, "msg": "a warning"},
        {"msg": "Nothing to be done (all files are present)."},
    )
    assert lines[0].endswith(" FAILED: fom")
    assert lines[1:] == [
        "Missing input files", "a warning", "Nothing to be done (all files are present).",
    ]  # fmt: skip


def test_a_dry_run_prints_numbers_of_jobs_once_and_reasons(emit):
    stats = {"event": LogEvent.RUN_INFO, "stats": {"total": 2}, "msg": "Job stats: 2"}
    lines = emit(stats, JOB, stats, {"msg": "Reasons: x"}, {"msg": "a dry-run"}, dryrun=True)
    assert lines == ["Job stats: 2", "Reasons: x"]
